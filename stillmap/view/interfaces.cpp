// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/interfaces.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <ifaddrs.h>
#include <memory>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr int kFirstFreePort = 1024;  // ports below are reserved for the administrator

/// Tries to listen at an address. Returns 0 or the number of the system's error.
int listening_errno(const in_addr& host, int port) {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  if (descriptor < 0) return errno;
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr = host;
  name.sin_port = htons(static_cast<std::uint16_t>(port));
  const int on = 1;
  setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const bool listens =
      bind(descriptor, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0 &&
      listen(descriptor, 1) == 0;
  const int error = listens ? 0 : errno;
  close(descriptor);
  return error;
}

}  // namespace

std::vector<std::string> reachable_hosts(const std::string& host) {
  if (host != "0.0.0.0") return {host};
  std::vector<std::string> hosts;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) list = nullptr;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(list, freeifaddrs);
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    const bool up = (entry->ifa_flags & static_cast<unsigned>(IFF_UP)) != 0;
    if (!up || entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* name = reinterpret_cast<const sockaddr_in*>(entry->ifa_addr);
    if (inet_ntop(AF_INET, &name->sin_addr, text.data(), text.size()) != nullptr &&
        !is_loopback(text.data())) {
      hosts.emplace_back(text.data());
    }
  }
  std::sort(hosts.begin(), hosts.end());
  hosts.emplace_back("127.0.0.1");
  return hosts;
}

Error listening_error(const ViewAddress& address) {
  if (address.host.find(':') != std::string::npos) {
    return {"the server of the page has no IPv6", "--view-address " + address.host,
            "use an IPv4 address, such as 0.0.0.0 for all networks"};
  }
  const std::string& option = address.port_option;
  in_addr host{};
  const std::string name = address.host == "localhost" ? "127.0.0.1" : address.host;
  const int error = inet_pton(AF_INET, name.c_str(), &host) == 1
                        ? listening_errno(host, address.port)
                        : EADDRNOTAVAIL;
  if (error == EADDRNOTAVAIL) {
    return {address.host + " is no address of this computer", "--view-address",
            "give the IPv4 address of one of its network interfaces, or 0.0.0.0 for all"};
  }
  if (error == EACCES && address.port < kFirstFreePort) {
    return {fmt::format("port {} is reserved for the administrator", address.port), option,
            fmt::format("use a port from {} on, or {} 0 (any free port)", kFirstFreePort, option)};
  }
  return {fmt::format("port {} is in use", address.port), option,
          fmt::format("use another port, or {} 0 (any free port)", option)};
}

}  // namespace stillmap
