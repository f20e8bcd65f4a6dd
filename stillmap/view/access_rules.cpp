// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/access_rules.hpp"

#include <random>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Returns a Host header without its port: "[::1]:80" and "::1" are "::1".
std::string_view without_port(std::string_view host) {
  if (host.starts_with('[')) return host.substr(1, host.find(']') - 1);
  const auto colon = host.find(':');
  return colon == host.rfind(':') ? host.substr(0, colon) : host;
}

/// Compares in a time that does not depend on the position of the first difference.
bool equal_secrets(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i)
    difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

}  // namespace

std::optional<std::string> refusal(const AccessRequest& request, const ViewAddress& address,
                                   bool for_data) {
  if (request.method != "GET" && request.method != "HEAD") return "the view is read-only";
  if (is_loopback(address.host) && !is_loopback(without_port(request.host)))
    return "the host is not this computer";
  if (!for_data) return std::nullopt;
  if (request.origin && *request.origin != "http://" + request.host &&
      *request.origin != "https://" + request.host)
    return "the page belongs to another site";
  if (!address.token.empty() && !equal_secrets(request.token, address.token))
    return "the token is missing or wrong: use the address that Stillmap printed";
  return std::nullopt;
}

bool is_loopback(std::string_view host) {
  const bool numeric = host.find_first_not_of("0123456789.") == std::string_view::npos;
  return (numeric && host.starts_with("127.")) || host == "::1" || host == "localhost";
}

std::string random_token() {
  std::random_device random;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", static_cast<std::uint32_t>(random()));
  return token;
}

}  // namespace stillmap
