// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap {

/// A receiver of events: http://HOST[:PORT][/PATH] or mqtt://[USER:PASSWORD@]HOST[:PORT]/TOPIC;
/// encrypted with https:// and mqtts://.
struct EventAddress {
  enum class Protocol { kHttp, kMqtt };
  Protocol protocol = Protocol::kHttp;
  bool encrypted = false;  ///< By TLS; the certificate of the receiver is verified.
  std::string host;
  int port = 80;
  std::string path;            ///< HTTP: path and query, from its slash on; MQTT: the topic.
  std::string user, password;  ///< MQTT only; empty: none.

  std::string text() const;  ///< The address without user and password.
};

/// Reads an address. Throws Error, naming `where`, if it is malformed.
EventAddress parse_event_address(const std::string& address, const std::string& where);

}  // namespace stillmap
