// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/warn/event_address.hpp"
#include "stillmap/warn/event_sender.hpp"

#include <string>

namespace stillmap {

/// Returns the delivery of events to an address: by POST with the event as the body, or by
/// MQTT (quality of service 1); the connection is kept. Certificates of encrypted addresses are
/// verified with those of the system, or of the file that the environment variable SSL_CERT_FILE
/// names. Throws Error for MQTT if this program was built without it.
/// @param run  identity of the run in the last words of MQTT, see mqtt_delivery()
Deliver delivery_to(const EventAddress& address, const std::string& run);

/// Returns the file of trusted certificates: SSL_CERT_FILE if it is set, otherwise the first that
/// exists of the usual files of Debian, Fedora and openSUSE.
std::string certificate_file();
inline constexpr const char* kCertificateAdvice =
    "install the package ca-certificates, or name a file by SSL_CERT_FILE";

/// Returns the delivery by MQTT; see delivery_to(). If the program dies, the broker publishes
/// `last_words` in its place.
Deliver mqtt_delivery(const EventAddress& address, const std::string& last_words);

}  // namespace stillmap
