// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/event_delivery.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/json_text.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <curl/curl.h>
#include <filesystem>
#include <memory>

#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

// Longest times until an HTTP server accepts a connection and until its answer [ms]: one that
// begins with a cold start or writes to a slow disk answers within it.
constexpr long kConnectTimeout = 10000, kAnswerTimeout = 10000;

/// What an HTTP server answers to an event.
Delivered delivered_with(long status) {
  constexpr long kTooManyRequests = 429;
  if (status >= 200 && status < 300) return Delivered::kYes;
  return status >= 500 || status == kTooManyRequests ? Delivered::kLater : Delivered::kNo;
}

/// libcurl while somebody uses it.
struct CurlLibrary {
  CurlLibrary() { curl_global_init(CURL_GLOBAL_DEFAULT); }
  ~CurlLibrary() { curl_global_cleanup(); }
  CurlLibrary(const CurlLibrary&) = delete;
  CurlLibrary& operator=(const CurlLibrary&) = delete;
};

/// A connection to an HTTP server, which is kept as long as the server keeps it.
class HttpConnection {
 public:
  explicit HttpConnection(const EventAddress& address) {
    if (!handle_ || !headers_)
      throw Error("out of memory", address.text(), "end other programs on this computer");
    set(CURLOPT_URL, address.text().c_str());
    set(CURLOPT_HTTPHEADER, headers_.get());
    set(CURLOPT_PROXY, "");
    set(CURLOPT_CONNECTTIMEOUT_MS, kConnectTimeout);
    set(CURLOPT_TIMEOUT_MS, kConnectTimeout + kAnswerTimeout);
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_ERRORBUFFER, problem_.data());
    set(CURLOPT_WRITEFUNCTION, ignore);
    set(CURLOPT_CAINFO, certificate_file().c_str());
  }

  Delivery post(const std::string& event) {
    problem_[0] = '\0';
    set(CURLOPT_POSTFIELDSIZE, static_cast<long>(event.size()));
    set(CURLOPT_POSTFIELDS, event.data());
    const CURLcode code = curl_easy_perform(handle_.get());
    if (code == CURLE_SSL_CACERT_BADFILE)
      return {Delivered::kLater,
              certificate_file() + " has no certificates that can be read; " + kCertificateAdvice};
    if (code != CURLE_OK)
      return {Delivered::kLater, problem_[0] == '\0' ? curl_easy_strerror(code) : problem_.data()};
    long status = 0;
    curl_easy_getinfo(handle_.get(), CURLINFO_RESPONSE_CODE, &status);
    return delivered_with(status);
  }

 private:
  template <typename T>
  void set(CURLoption option, T value) {
    curl_easy_setopt(handle_.get(), option, value);
  }
  static std::size_t ignore(const char*, std::size_t size, std::size_t count, void*) {
    return size * count;
  }

  CurlLibrary library_;
  std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> handle_{curl_easy_init(), curl_easy_cleanup};
  std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)> headers_{
      curl_slist_append(nullptr, "Content-Type: application/json"), curl_slist_free_all};
  std::array<char, CURL_ERROR_SIZE> problem_{};
};

}  // namespace

std::string certificate_file() {
  if (const char* own = std::getenv("SSL_CERT_FILE")) return own;
  constexpr std::array kFiles = {"/etc/ssl/certs/ca-certificates.crt",
                                 "/etc/pki/tls/certs/ca-bundle.crt", "/etc/ssl/ca-bundle.pem"};
  const auto* const found = std::find_if(
      kFiles.begin(), kFiles.end(), [](const char* file) { return std::filesystem::exists(file); });
  return found == kFiles.end() ? kFiles.front() : *found;
}

Deliver delivery_to(const EventAddress& address, const std::string& run) {
  if (address.protocol == EventAddress::Protocol::kMqtt) {
    const std::string rule = "the program has ended unexpectedly";
    return mqtt_delivery(address, json_text({{"run", run},
                                             {"event", "begin"},
                                             {"kind", "unknown"},
                                             {"rule", rule},
                                             {"text", "not known: " + rule}}));
  }
  return [connection = std::make_shared<HttpConnection>(address)](const std::string& event) {
    return connection->post(event);
  };
}

}  // namespace stillmap
