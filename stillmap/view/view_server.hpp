// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/view/access_rules.hpp"
#include "stillmap/view/topic_board.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace stillmap {

/// Traffic of the view.
struct ViewTraffic {
  std::size_t clients = 0;     ///< Number of pages that are connected now.
  std::size_t connected = 0;   ///< Number of pages that have ever connected.
  std::uint64_t messages = 0;  ///< Number of messages sent.
  std::uint64_t bytes = 0;     ///< Size of these messages [bytes].
  /// Number of messages that a page did not get, since a newer one of the same topic was there
  /// before the page was ready for it.
  std::uint64_t skipped = 0;
};

/// Serves the page of the view and the images of a finished run by HTTP, and the messages of a
/// board by WebSocket (path /data): see docs/view.md. Each page has its own thread, which sends at
/// the speed of the page. A page that stalls is disconnected after some seconds; nobody else waits
/// for it.
class ViewServer {
 public:
  /// Starts to listen. Throws Error if the address cannot be used.
  explicit ViewServer(const ViewAddress& address);
  /// Closes all connections.
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// The messages that the pages get. May be used by any thread.
  TopicBoard& board();

  /// Returns the addresses to open in a browser, with the token if there is one: those of all
  /// network interfaces at which the server listens, the one for this computer only last.
  std::vector<std::string> urls() const;

  /// Returns the traffic so far. May be called by any thread.
  ViewTraffic traffic() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace stillmap
