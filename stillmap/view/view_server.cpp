// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/view_server.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/view/interfaces.hpp"
#include "stillmap/view/page_files.hpp"
#include "stillmap/view/run_images.hpp"

#include <array>
#include <civetweb.h>
#include <map>
#include <mutex>
#include <thread>

#include <fmt/format.h>

namespace stillmap {
namespace {

// Each page occupies one thread of the server for its WebSocket, and its files need one more.
constexpr std::size_t kMaxClients = 12;
constexpr const char* kThreads = "16";
// Time after which a page that does not take its messages is disconnected [ms].
constexpr const char* kStallTimeout = "30000";
// Time after which a connection without any message from the page is closed [ms]: the page says
// nothing but answers pings, so this is long.
constexpr const char* kSilenceTimeout = "86400000";

// Path that tells a page whether it may have the data, or why not.
constexpr std::string_view kAccess = "/access";
// Path of the image of a finished run that is nearest to the time t [s].
constexpr std::string_view kImage = "/image";

std::string header(const mg_connection* connection, const char* name) {
  const char* value = mg_get_header(connection, name);
  return value == nullptr ? "" : value;
}

/// Returns a variable of the query; empty without it.
std::string query_value(const mg_request_info& request, const char* name) {
  if (request.query_string == nullptr) return "";
  const std::string query = request.query_string;
  std::array<char, 256> value{};
  const int length = mg_get_var(query.data(), query.size(), name, value.data(), value.size());
  return length > 0 ? std::string(value.data(), static_cast<std::size_t>(length)) : "";
}

AccessRequest access_request(const mg_connection* connection) {
  const mg_request_info& request = *mg_get_request_info(connection);
  AccessRequest access{.method = request.request_method,
                       .host = header(connection, "Host"),
                       .origin = std::nullopt,
                       .token = query_value(request, "token")};
  if (mg_get_header(connection, "Origin") != nullptr) access.origin = header(connection, "Origin");
  return access;
}

/// Answers with a short text or a file. The policy allows nothing that is not part of the page.
int answer(mg_connection* connection, int status, std::string_view type, std::string_view body) {
  const bool head = std::string_view(mg_get_request_info(connection)->request_method) == "HEAD";
  const std::string headers = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nCache-Control: no-cache\r\n"
      "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n"
      "X-Frame-Options: SAMEORIGIN\r\n"
      "Content-Security-Policy: default-src 'self'; img-src 'self' blob:; "
      "connect-src 'self' ws: wss:\r\nConnection: close\r\n\r\n",
      status, mg_get_response_code_text(connection, status), type, body.size());
  mg_write(connection, headers.data(), headers.size());
  if (!head) mg_write(connection, body.data(), body.size());
  return status;
}

std::string in_brackets(const std::string& host) {
  return host.find(':') == std::string::npos ? host : "[" + host + "]";
}

}  // namespace

struct ViewServer::Impl {
  explicit Impl(const ViewAddress& address);
  ~Impl();

  static int serve_file(mg_connection* connection, void* self);
  int serve_image(mg_connection* connection) const;
  static int admit(const mg_connection* connection, void* self);
  static void open(mg_connection* connection, void* self);
  static int receive(mg_connection* connection, int bits, char* data, std::size_t size, void* self);
  static void close(const mg_connection* connection, void* self);

  void send_messages(mg_connection* connection, const std::stop_token& stop);

  ViewAddress address;
  TopicBoard board;
  mutable std::mutex mutex;
  ViewTraffic traffic;                                   // under the mutex
  std::map<const mg_connection*, std::jthread> senders;  // under the mutex
  mg_context* context = nullptr;                         // last: its threads use the above
};

ViewServer::Impl::Impl(const ViewAddress& given) : address(given) {
  const std::string listen = fmt::format("{}:{}", in_brackets(address.host), address.port);
  const std::array<const char*, 13> settings{"listening_ports",
                                             listen.c_str(),
                                             "num_threads",
                                             kThreads,
                                             "request_timeout_ms",
                                             kStallTimeout,
                                             "websocket_timeout_ms",
                                             kSilenceTimeout,
                                             "enable_directory_listing",
                                             "no",
                                             "tcp_nodelay",
                                             "1",
                                             nullptr};
  mg_init_library(0);
  const mg_callbacks callbacks{};
  context = mg_start(&callbacks, nullptr, const_cast<const char**>(settings.data()));
  if (context == nullptr) {
    mg_exit_library();
    throw listening_error(address);
  }
  mg_server_port port{};
  if (mg_get_server_ports(context, 1, &port) == 1) address.port = port.port;
  mg_set_request_handler(context, "/", serve_file, this);
  mg_set_websocket_handler(context, "/data", admit, open, receive, close, this);
}

ViewServer::Impl::~Impl() {
  {
    const std::unique_lock lock(mutex);
    for (auto& [connection, sender] : senders) sender.request_stop();
  }
  mg_stop(context);  // calls close() for every page
  mg_exit_library();
}

int ViewServer::Impl::serve_file(mg_connection* connection, void* self) {
  const Impl& server = *static_cast<Impl*>(self);
  if (const auto reason = refusal(access_request(connection), server.address, false))
    return answer(connection, 403, "text/plain", *reason + "\n");
  const std::string_view path = mg_get_request_info(connection)->local_uri;
  if (path == kAccess || path == kImage) {
    const auto reason = refusal(access_request(connection), server.address, true);
    if (reason) return answer(connection, 403, "text/plain", *reason);
    if (path == kImage) return server.serve_image(connection);
    return answer(connection, 200, "text/plain", "ok");  // a WebSocket does not tell why not
  }
  const PageFile* file = find_page_file(path);
  if (file == nullptr) return answer(connection, 404, "text/plain", "there is no such file\n");
  return answer(connection, 200, file->type, file->content);
}

int ViewServer::Impl::serve_image(mg_connection* connection) const {
  const std::shared_ptr<RunImages> images = board.images();
  const std::string time = query_value(*mg_get_request_info(connection), "t");
  const std::optional<double> timestamp = number_of(time);
  if (!images || !timestamp) return answer(connection, 404, "text/plain", "No image.");
  const ViewedImage image = images->at(*timestamp);
  if (image.jpeg.empty()) return answer(connection, 404, "text/plain", image.problem);
  return answer(connection, 200, "image/jpeg", image.jpeg);
}

/// Returns 0 if a WebSocket may be opened.
int ViewServer::Impl::admit(const mg_connection* connection, void* self) {
  const Impl& server = *static_cast<Impl*>(self);
  if (refusal(access_request(connection), server.address, true)) return 1;
  const std::unique_lock lock(server.mutex);
  return server.traffic.clients < kMaxClients ? 0 : 1;
}

void ViewServer::Impl::open(mg_connection* connection, void* self) {
  Impl& server = *static_cast<Impl*>(self);
  const std::unique_lock lock(server.mutex);
  ++server.traffic.clients;
  ++server.traffic.connected;
  server.senders[connection] = std::jthread([&server, connection](const std::stop_token& stop) {
    server.send_messages(connection, stop);
  });
}

/// Ignores what a page sends, except its wish to close.
int ViewServer::Impl::receive(mg_connection*, int bits, char*, std::size_t, void*) {
  const int opcode = bits & 0xf;
  return opcode == MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE ? 0 : 1;
}

void ViewServer::Impl::close(const mg_connection* connection, void* self) {
  Impl& server = *static_cast<Impl*>(self);
  std::jthread sender;
  {
    const std::unique_lock lock(server.mutex);
    const auto found = server.senders.find(connection);
    if (found == server.senders.end()) return;
    sender = std::move(found->second);
    server.senders.erase(found);
    --server.traffic.clients;
  }
  sender.request_stop();
  sender.join();
}

void ViewServer::Impl::send_messages(mg_connection* connection, const std::stop_token& stop) {
  const std::uint64_t first = board.version();  // what is older was never missed
  std::uint64_t version = 0;
  while (const auto posting = board.next(version, stop)) {
    const int opcode = posting->binary ? MG_WEBSOCKET_OPCODE_BINARY : MG_WEBSOCKET_OPCODE_TEXT;
    const int sent =
        mg_websocket_write(connection, opcode, posting->bytes->data(), posting->bytes->size());
    // The page has gone or stalls, and may have got a part of the message only: close() follows.
    if (sent < static_cast<int>(posting->bytes->size())) return;
    const std::unique_lock lock(mutex);
    ++traffic.messages;
    traffic.bytes += posting->bytes->size();
    if (posting->version > first)
      traffic.skipped += posting->version - std::max(version, first) - 1;
    version = posting->version;
  }
}

ViewServer::ViewServer(const ViewAddress& address) : impl_(std::make_unique<Impl>(address)) {}
ViewServer::~ViewServer() = default;

TopicBoard& ViewServer::board() { return impl_->board; }

std::vector<std::string> ViewServer::urls() const {
  const ViewAddress& address = impl_->address;
  const std::string query = address.token.empty() ? "" : "?token=" + address.token;
  std::vector<std::string> urls;
  for (const std::string& host : reachable_hosts(address.host))
    urls.push_back(fmt::format("http://{}:{}/{}", in_brackets(host), address.port, query));
  return urls;
}

ViewTraffic ViewServer::traffic() const {
  const std::unique_lock lock(impl_->mutex);
  return impl_->traffic;
}

}  // namespace stillmap
