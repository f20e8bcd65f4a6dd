// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace stillmap {

/// Where the view listens, and what it asks for.
struct ViewAddress {
  std::string host = "127.0.0.1";      ///< IP address of the network interface.
  int port = 8360;                     ///< 0: any free port.
  std::string token;                   ///< Secret that clients must send; empty: none is needed.
  std::string port_option = "--view";  ///< Option that the port was given by, for messages.
};

/// Headers and query of a request that decide about access.
struct AccessRequest {
  std::string method = "GET";
  std::string host;                   ///< Header Host, such as "127.0.0.1:8360".
  std::optional<std::string> origin;  ///< Header Origin; programs other than browsers send none.
  std::string token;                  ///< Value of `token` in the query; empty if there is none.
};

/// Returns why a request is refused; none if it is allowed. Read access only. A page of another
/// site cannot read the data through the user's browser: its Origin differs from the Host, and
/// where the view listens to this computer only, a Host that names another computer (DNS rebinding)
/// is refused. Where the view has a token, requests for data must send it.
std::optional<std::string> refusal(const AccessRequest& request, const ViewAddress& address,
                                   bool for_data);

/// Returns whether an address reaches this computer only: 127.x.y.z, ::1 or localhost.
bool is_loopback(std::string_view host);

/// Returns 128 random bits in hexadecimal digits.
std::string random_token();

}  // namespace stillmap
