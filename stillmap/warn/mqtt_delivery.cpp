// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/warn/event_delivery.hpp"

#ifdef STILLMAP_HAS_MQTT
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <memory>
#include <mosquitto.h>
#include <mutex>
#endif

namespace stillmap {

#ifdef STILLMAP_HAS_MQTT
namespace {

constexpr std::chrono::milliseconds kTimeout{2000};  // longest time until the broker's answer
constexpr int kKeepAlive = 10;  // time after which the broker misses the program [s]
constexpr int kQuality = 1;     // delivered at least once
// Times between two attempts to connect, from the first to the longest [s].
constexpr unsigned kShortestPause = 1, kLongestPause = 5;

/// A connection to a broker. The library's thread keeps it and connects again.
class MqttConnection {
 public:
  MqttConnection(const EventAddress& address, const std::string& last_words) : address_(address) {
    mosquitto_lib_init();
    client_ = mosquitto_new(nullptr, true, this);
    if (client_ == nullptr)
      throw Error("out of memory", address.text(), "end other programs on this computer");
    if (!address.user.empty())
      mosquitto_username_pw_set(client_, address.user.c_str(), address.password.c_str());
    if (address.encrypted) verify_certificates();
    mosquitto_will_set(client_, address.path.c_str(), static_cast<int>(last_words.size()),
                       last_words.data(), kQuality, false);
    mosquitto_reconnect_delay_set(client_, kShortestPause, kLongestPause, false);
    mosquitto_connect_callback_set(client_, on_connect);
    mosquitto_disconnect_callback_set(client_, on_disconnect);
    mosquitto_publish_callback_set(client_, on_publish);
    mosquitto_log_callback_set(client_, on_log);
    mosquitto_connect_async(client_, address.host.c_str(), address.port, kKeepAlive);
    mosquitto_loop_start(client_);
  }
  ~MqttConnection() {
    bool away = true;
    {
      const std::unique_lock lock(mutex_);
      away = !connected_;
    }
    mosquitto_disconnect(client_);
    mosquitto_loop_stop(client_, away);  // a thread that tries to connect is not waited for
    mosquitto_destroy(client_);
    mosquitto_lib_cleanup();
  }
  MqttConnection(const MqttConnection&) = delete;
  MqttConnection& operator=(const MqttConnection&) = delete;

  Delivery publish(const std::string& event) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kTimeout, [&] { return connected_ || refused_; });
    if (!connected_) return {Delivered::kLater, problem_};
    lock.unlock();  // the library calls back
    int message = 0;
    if (mosquitto_publish(client_, &message, address_.path.c_str(), static_cast<int>(event.size()),
                          event.data(), kQuality, false) != MOSQ_ERR_SUCCESS)
      return Delivered::kLater;
    lock.lock();
    // From here on the library repeats the message until the broker has it.
    changed_.wait_for(lock, kTimeout, [&] { return acknowledged_ == message; });
    return Delivered::kYes;
  }

 private:
  /// Not by MOSQ_OPT_TLS_USE_OS_CERTS, with which libmosquitto 2.0.11 never connects again.
  void verify_certificates() {
    const std::string file = certificate_file();
    if (mosquitto_tls_set(client_, file.c_str(), nullptr, nullptr, nullptr, nullptr) ==
        MOSQ_ERR_SUCCESS)
      return;
    mosquitto_destroy(client_);
    throw Error("has no certificates that can be read", file, kCertificateAdvice);
  }
  static MqttConnection& self(void* object) { return *static_cast<MqttConnection*>(object); }
  static void on_connect(mosquitto*, void* object, int code) {
    self(object).set_connected(code == 0, code != 0);
  }
  static void on_disconnect(mosquitto*, void* object, int) {
    self(object).set_connected(false, false);
  }
  /// Keeps what OpenSSL says, such as that the certificate is not valid.
  static void on_log(mosquitto*, void* object, int level, const char* text) {
    if (level != MOSQ_LOG_ERR) return;
    const std::unique_lock lock(self(object).mutex_);
    self(object).problem_ = text;
  }
  static void on_publish(mosquitto*, void* object, int message) {
    MqttConnection& connection = self(object);
    const std::unique_lock lock(connection.mutex_);
    connection.acknowledged_ = message;
    connection.changed_.notify_all();
  }
  void set_connected(bool connected, bool refused) {
    const std::unique_lock lock(mutex_);
    connected_ = connected;
    refused_ = refused;
    changed_.notify_all();
  }

  const EventAddress address_;
  mosquitto* client_ = nullptr;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool connected_ = false, refused_ = false;  // under the mutex
  std::string problem_;                       // newest error of the library; under the mutex
  int acknowledged_ = 0;                      // newest message that the broker has; under the mutex
};

}  // namespace

Deliver mqtt_delivery(const EventAddress& address, const std::string& last_words) {
  auto connection = std::make_shared<MqttConnection>(address, last_words);
  return [connection](const std::string& event) { return connection->publish(event); };
}

#else

Deliver mqtt_delivery(const EventAddress& address, const std::string& /*last_words*/) {
  throw Error("this program was built without MQTT", address.text(),
              "install libmosquitto-dev and build it again, or use an http address");
}

#endif

}  // namespace stillmap
