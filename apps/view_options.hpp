// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/view/view_server.hpp"

#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

namespace stillmap {

/// The options of `stillmap run` that show the run in a browser.
struct ViewOptions {
  std::optional<int> port;  ///< None: the run is not shown; 0: any free port.
  std::string address;      ///< IP address of the network interface; empty: this computer only.
  std::string port_option = "--view";  ///< Name of the option of `port`, for messages.
};

/// Adds --view and --view-address.
void add_view_options(CLI::App& command, ViewOptions& options);
/// Adds --view-address only.
void add_view_address(CLI::App& command, std::string& address);

/// Returns where the page is served; none without --view. If other computers can reach the address,
/// it gets a random token. Throws Error for --view-address without --view and a port out of range.
std::optional<ViewAddress> view_address_of(const ViewOptions& options);

/// Returns the addresses of the page for users, one per line.
std::string addresses_text(const ViewServer& server);

/// Returns the server of a page, after printing its addresses; null without an address.
std::unique_ptr<ViewServer> opened_view(const std::optional<ViewAddress>& address);

}  // namespace stillmap
