// SPDX-License-Identifier: Apache-2.0
#include "stillmap/warn/event_sender.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/warn/event_address.hpp"
#include "stillmap/warn/event_delivery.hpp"

#include <cstdlib>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

namespace stillmap {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(CertificateFile, IsThatOfTheVariableOrOfTheSystem) {
  const char* given = std::getenv("SSL_CERT_FILE");
  const std::string before = given != nullptr ? given : "";
  setenv("SSL_CERT_FILE", "/own/certificates.pem", 1);
  EXPECT_EQ(certificate_file(), "/own/certificates.pem");
  unsetenv("SSL_CERT_FILE");
  EXPECT_THAT(certificate_file(), testing::AnyOf(HasSubstr("/etc/ssl/"), HasSubstr("/etc/pki/")));
  if (!before.empty()) setenv("SSL_CERT_FILE", before.c_str(), 1);
}

TEST(EventSender, SendsAllEventsInTheirOrderBeforeItEnds) {
  std::vector<std::string> received;
  EventSender sender([&](const std::string& event) {
    received.push_back(event);
    return event == "b" ? Delivered::kNo : Delivered::kYes;
  });
  for (const char* event : {"a", "b", "c"}) sender.send(event);
  const SentEvents counts = sender.finish();
  EXPECT_THAT(received, ElementsAre("a", "b", "c"));
  EXPECT_EQ(counts.sent, 2U);
  EXPECT_EQ(counts.refused, 1U);
  EXPECT_EQ(counts.dropped, 0U);
}

TEST(EventSender, AReceiverThatBlocksMakesNobodyWaitAndTheOldestEventsAreDropped) {
  std::promise<void> begun, go;
  std::vector<std::string> received;
  EventSender sender([&](const std::string& event) {
    if (received.empty()) {
      begun.set_value();
      go.get_future().wait();
    }
    received.push_back(event);
    return Delivered::kYes;
  });
  sender.send("first");
  begun.get_future().wait();
  const std::size_t more = EventSender::kQueue + 10;
  for (std::size_t i = 0; i < more; ++i) sender.send(std::to_string(i));  // returns while it blocks
  go.set_value();
  const SentEvents counts = sender.finish();
  EXPECT_EQ(counts.sent, 1 + EventSender::kQueue);
  EXPECT_EQ(counts.dropped, 10U);
  EXPECT_EQ(received.at(1), "10");
  EXPECT_EQ(received.back(), std::to_string(more - 1));
}

TEST(EventSender, EventsForAReceiverThatIsAwayAreTriedAgainAndDroppedAtTheEnd) {
  int attempts = 0;
  std::promise<void> again;
  EventSender sender([&](const std::string&) {
    if (++attempts == 2) again.set_value();
    return Delivered::kLater;
  });
  sender.send("a");
  sender.send("b");
  again.get_future().wait();
  const SentEvents counts = sender.finish();
  EXPECT_EQ(counts.sent, 0U);
  EXPECT_EQ(counts.dropped, 2U);
}

TEST(EventSender, AReceiverThatRefusedForAMomentGetsTheEventsAtTheEnd) {
  std::promise<void> refused;
  std::vector<std::string> received;
  bool first = true;
  EventSender sender([&](const std::string& event) {
    if (std::exchange(first, false)) {
      refused.set_value();
      return Delivered::kLater;
    }
    received.push_back(event);
    return Delivered::kYes;
  });
  for (const char* event : {"a", "b"}) sender.send(event);
  refused.get_future().wait();
  EXPECT_EQ(sender.finish().sent, 2U);
  EXPECT_THAT(received, ElementsAre("a", "b"));
}

TEST(EventSender, SeveralSendersFinishAtTheSameTime) {
  std::promise<void> last_attempt;
  bool finishing = false;
  std::promise<void> waits;
  EventSender slow([&](const std::string&) {
    waits.set_value();
    last_attempt.get_future().wait();  // until the other one finishes
    return Delivered::kYes;
  });
  std::promise<void> refused, go;
  EventSender away([&](const std::string&) {
    if (finishing) {
      last_attempt.set_value();
    } else {
      refused.set_value();
      go.get_future().wait();
      finishing = true;
    }
    return Delivered::kLater;
  });
  slow.send("a");
  away.send("b");
  waits.get_future().wait();
  refused.get_future().wait();
  for (EventSender* sender : {&slow, &away}) sender->begin_finish();
  go.set_value();
  EXPECT_EQ(slow.finish().sent, 1U);
  EXPECT_EQ(away.finish().dropped, 1U);
}

std::string problem_of(const std::string& address) {
  try {
    parse_event_address(address, "rules.yaml");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(EventAddress, IsRead) {
  const EventAddress http = parse_event_address("http://crane.local:8080/warn?a=b:c", "");
  EXPECT_EQ(http.protocol, EventAddress::Protocol::kHttp);
  EXPECT_EQ(http.host, "crane.local");
  EXPECT_EQ(http.port, 8080);
  EXPECT_EQ(http.path, "/warn?a=b:c");
  EXPECT_EQ(parse_event_address("http://[::1]", "").host, "::1");
  EXPECT_EQ(parse_event_address("http://a", "").path, "/");
  const EventAddress mqtt = parse_event_address("mqtt://me:p@ss@broker/site/warnings", "");
  EXPECT_EQ(mqtt.protocol, EventAddress::Protocol::kMqtt);
  EXPECT_EQ(mqtt.user, "me");
  EXPECT_EQ(mqtt.password, "p@ss");
  EXPECT_EQ(mqtt.port, 1883);
  EXPECT_EQ(mqtt.path, "site/warnings");
  EXPECT_EQ(mqtt.text(), "mqtt://broker:1883/site/warnings");
  EXPECT_EQ(parse_event_address("mqtt://broker/site/crane 1", "").path, "site/crane 1");
}

TEST(EventAddress, MayBeEncrypted) {
  const EventAddress https = parse_event_address("https://crane.local/warn", "");
  EXPECT_TRUE(https.encrypted);
  EXPECT_EQ(https.port, 443);
  EXPECT_EQ(https.text(), "https://crane.local:443/warn");
  const EventAddress mqtts = parse_event_address("mqtts://me:secret@broker/site", "");
  EXPECT_EQ(mqtts.protocol, EventAddress::Protocol::kMqtt);
  EXPECT_TRUE(mqtts.encrypted);
  EXPECT_EQ(mqtts.port, 8883);
  EXPECT_EQ(mqtts.text(), "mqtts://broker:8883/site");
  EXPECT_FALSE(parse_event_address("http://a", "").encrypted);
}

TEST(EventAddress, MistakesAreNamed) {
  EXPECT_THAT(problem_of("ftp://a/b"), HasSubstr("no address of a receiver"));
  EXPECT_THAT(problem_of("localhost:80"), HasSubstr("no address of a receiver"));
  EXPECT_THAT(problem_of("httpss://a/b"), HasSubstr("no address of a receiver"));
  EXPECT_THAT(problem_of("http://:80/"), HasSubstr("no host"));
  EXPECT_THAT(problem_of("http://a:0/"), HasSubstr("no valid port"));
  EXPECT_THAT(problem_of("http://a:99999/"), HasSubstr("no valid port"));
  EXPECT_THAT(problem_of("http://a/b c"), HasSubstr("%20"));
  EXPECT_THAT(problem_of("http://a/b\r\nX:y"), HasSubstr("new line"));
  EXPECT_THAT(problem_of("mqtt://a b/c"), HasSubstr("host with a space"));
  EXPECT_THAT(problem_of("mqtt://a"), HasSubstr("no topic"));
  EXPECT_THAT(problem_of("mqtt://a/#"), HasSubstr("no topic"));
}

}  // namespace
}  // namespace stillmap
