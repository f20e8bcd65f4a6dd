// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/event_address.hpp"

#include "stillmap/base/error.hpp"

#include <charconv>
#include <string_view>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr int kHttpPort = 80, kHttpsPort = 443, kMqttPort = 1883, kMqttsPort = 8883;
constexpr int kMaxPort = 65535;

/// Returns the text before the first `mark`, and removes both from `rest`; all of it without one.
std::string_view take_until(std::string_view& rest, std::string_view mark) {
  const auto at = rest.find(mark);
  const std::string_view taken = rest.substr(0, at);
  rest = at == std::string_view::npos ? std::string_view() : rest.substr(at + mark.size());
  return taken;
}

/// Returns a port; 0 if the text is none.
int port_of(std::string_view text) {
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && port > 0 && port <= kMaxPort ? port : 0;
}

}  // namespace

std::string EventAddress::text() const {
  const bool http = protocol == Protocol::kHttp;
  const bool v6 = host.find(':') != std::string::npos;
  return fmt::format("{}{}://{}:{}{}{}", http ? "http" : "mqtt", encrypted ? "s" : "",
                     v6 ? "[" + host + "]" : host, port, http ? "" : "/", path);
}

EventAddress parse_event_address(const std::string& address, const std::string& where) {
  const auto fail = [&](const std::string& what) {
    throw Error(what + ": " + address, where,
                "use http://HOST:PORT/PATH or mqtt://HOST:PORT/TOPIC, or https and mqtts");
  };
  EventAddress result;
  std::string_view rest = address;
  std::string_view protocol = take_until(rest, "://");
  result.encrypted = protocol == "https" || protocol == "mqtts";
  if (result.encrypted) protocol.remove_suffix(1);
  if (protocol != "http" && protocol != "mqtt") fail("is no address of a receiver of events");
  const bool mqtt = protocol == "mqtt";
  if (mqtt) result.protocol = EventAddress::Protocol::kMqtt;
  result.port =
      result.encrypted ? (mqtt ? kMqttsPort : kHttpsPort) : (mqtt ? kMqttPort : kHttpPort);
  std::string_view authority = take_until(rest, "/");
  result.path = std::string(mqtt ? "" : "/").append(rest);
  if (const auto at = authority.rfind('@'); at != std::string_view::npos) {
    if (!mqtt) fail("user names are not supported with http");
    std::string_view user = authority.substr(0, at);
    authority.remove_prefix(at + 1);
    result.user = std::string(take_until(user, ":"));
    result.password = std::string(user);
  }
  const auto colon = authority.rfind(':'), bracket = authority.rfind(']');
  if (colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket)) {
    result.port = port_of(authority.substr(colon + 1));
    if (result.port == 0) fail("has no valid port");
    authority = authority.substr(0, colon);
  }
  if (authority.starts_with('[') && authority.ends_with(']'))
    authority = authority.substr(1, authority.size() - 2);
  result.host = std::string(authority);
  if (result.host.empty()) fail("has no host");
  if (address.find_first_of("\t\r\n") != std::string::npos) fail("has a tab or a new line");
  if (result.host.find(' ') != std::string::npos) fail("has a host with a space");
  if (!mqtt && result.path.find(' ') != std::string::npos)
    fail("has a space, which is %20 in such an address");
  if (mqtt && (result.path.empty() || result.path.find_first_of("+#") != std::string::npos))
    fail("has no topic that can be published");
  return result;
}

}  // namespace stillmap
