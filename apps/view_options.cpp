// SPDX-License-Identifier: Apache-2.0
#include "view_options.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr int kMaxPort = 65535;

}  // namespace

void add_view_options(CLI::App& command, ViewOptions& options) {
  command
      .add_option("--view", options.port,
                  fmt::format("show the run in a browser, at this port ({}; 0: any free one)",
                              ViewAddress().port))
      ->expected(0, 1)
      ->default_str(std::to_string(ViewAddress().port));
  add_view_address(command, options.address);
}

void add_view_address(CLI::App& command, std::string& address) {
  command.add_option("--view-address", address,
                     "IP address at which the page is served, such as 0.0.0.0 for all networks; "
                     "other computers need the token of the printed address; default: this "
                     "computer only");
}

std::optional<ViewAddress> view_address_of(const ViewOptions& options) {
  if (!options.port) {
    if (options.address.empty()) return std::nullopt;
    throw Error("there is no --view", "--view-address", "add --view");
  }
  ViewAddress address{.host = ViewAddress().host,
                      .port = *options.port,
                      .token = "",
                      .port_option = options.port_option};
  if (address.port < 0 || address.port > kMaxPort) {
    const bool optional_value = options.port_option == ViewOptions().port_option;
    throw Error(
        fmt::format("{} is no port", address.port), options.port_option,
        fmt::format(
            "give a port from 0 to {}{}", kMaxPort,
            optional_value ? "; after --view the name of the sequence does not follow" : ""));
  }
  if (!options.address.empty()) address.host = options.address;
  if (!is_loopback(address.host)) address.token = random_token();
  return address;
}

std::string addresses_text(const ViewServer& server) {
  std::string text;
  for (const std::string& url : server.urls()) text += "view: " + url + "\n";
  return text;
}

std::unique_ptr<ViewServer> opened_view(const std::optional<ViewAddress>& address) {
  if (!address) return nullptr;
  auto server = std::make_unique<ViewServer>(*address);
  print_out("{}", addresses_text(*server));
  output_is_complete();  // shows the address now
  return server;
}

}  // namespace stillmap
