// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"
#include "stillmap/view/access_rules.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Returns the addresses at which a server is reached that listens at `host`: `host` itself, or,
/// for 0.0.0.0, the IPv4 addresses of the network interfaces that are up, 127.0.0.1 last.
std::vector<std::string> reachable_hosts(const std::string& host);

/// Returns why a server cannot listen at an address, with the fix: the port is in use or reserved,
/// or the address is not one of this computer.
Error listening_error(const ViewAddress& address);

}  // namespace stillmap
