// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/event_delivery.hpp"

#include "stillmap/base/json_text.hpp"

#include <array>
#include <civetweb.h>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

// Longest time until the answer of an HTTP server [ms]: a server that begins with a cold start or
// writes to a slow disk answers within it. To connect, CivetWeb takes 10 s at most as well.
constexpr int kAnswerTimeout = 10000;

/// What an HTTP server answers to an event.
Delivered delivered_with(int status) {
  constexpr int kTooManyRequests = 429;
  if (status >= 200 && status < 300) return Delivered::kYes;
  return status >= 500 || status == kTooManyRequests ? Delivered::kLater : Delivered::kNo;
}

Delivered post(const EventAddress& address, const std::string& event) {
  std::array<char, 256> problem{};
  mg_connection* connection =
      mg_connect_client(address.host.c_str(), address.port, 0, problem.data(), problem.size());
  if (connection == nullptr) return Delivered::kLater;
  const std::string request = fmt::format(
      "POST {} HTTP/1.1\r\nHost: {}:{}\r\nContent-Type: application/json\r\n"
      "Content-Length: {}\r\nConnection: close\r\n\r\n{}",
      address.path, address.host, address.port, event.size(), event);
  auto delivered = Delivered::kLater;
  if (mg_write(connection, request.data(), request.size()) == static_cast<int>(request.size()) &&
      mg_get_response(connection, problem.data(), problem.size(), kAnswerTimeout) >= 0)
    delivered = delivered_with(mg_get_response_info(connection)->status_code);
  mg_close_connection(connection);
  return delivered;
}

/// CivetWeb while somebody uses it.
struct WebLibrary {
  WebLibrary() { mg_init_library(0); }
  ~WebLibrary() { mg_exit_library(); }
  WebLibrary(const WebLibrary&) = delete;
  WebLibrary& operator=(const WebLibrary&) = delete;
};

}  // namespace

Deliver delivery_to(const EventAddress& address, const std::string& run) {
  if (address.protocol == EventAddress::Protocol::kMqtt) {
    const std::string rule = "the program has ended unexpectedly";
    return mqtt_delivery(address, json_text({{"run", run},
                                             {"event", "begin"},
                                             {"kind", "unknown"},
                                             {"rule", rule},
                                             {"text", "not known: " + rule}}));
  }
  return [address, library = std::make_shared<WebLibrary>()](const std::string& event) {
    return post(address, event);
  };
}

}  // namespace stillmap
