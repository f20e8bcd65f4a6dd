#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Warnings of a run, and their delivery by HTTP and MQTT to receivers on this computer.

  apps/warn_test.py PROGRAM     PROGRAM: the built command
"""
import http.server
import json
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path

PROGRAM = ""
ZONE = "zones: [{name: gate, polygon: [[-1, 1, 1], [1, 1, 1], [1, 1, 3], [-1, 1, 3]]}]\n"
NEAR = "distances: [{to: camera, nearer: 30}, {to: hook, nearer: 30, level: true}]\n"


class Receiver(http.server.ThreadingHTTPServer):
    """An HTTP server that keeps the bodies of the requests, and refuses the first ones."""

    def __init__(self, statuses=()):
        super().__init__(("127.0.0.1", 0), Handler)
        self.bodies, self.statuses = [], list(statuses)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def address(self):
        return f"http://127.0.0.1:{self.server_address[1]}/warnings"


class Handler(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"])).decode()
        status = self.server.statuses.pop(0) if self.server.statuses else 204
        if status == 204:
            self.server.bodies.append((self.path, self.headers["Content-Type"], body))
        self.send_response(status)
        self.end_headers()

    def log_message(self, *_):
        pass


class Broker(threading.Thread):
    """The little of an MQTT 3.1.1 broker that one publisher needs."""

    CONNECT, PUBLISH, PINGREQ, DISCONNECT = 1, 3, 12, 14

    def __init__(self):
        super().__init__(daemon=True)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.connect, self.messages, self.ended = b"", [], False
        self.start()

    def run(self):
        client = self.listener.accept()[0]
        with client, client.makefile("rb") as stream:
            while head := stream.read(1):
                kind, size, shift = head[0] >> 4, 0, 0
                while True:
                    byte = stream.read(1)[0]
                    size |= (byte & 127) << shift
                    shift += 7
                    if byte < 128:
                        break
                self.answer(client, kind, head[0], stream.read(size))
        self.listener.close()

    def answer(self, client, kind, head, content):
        if kind == self.CONNECT:
            self.connect = content
            client.sendall(bytes([0x20, 2, 0, 0]))
        elif kind == self.PUBLISH:
            end = 2 + int.from_bytes(content[:2], "big")
            assert head & 6 == 2, "quality of service 1"
            self.messages.append((content[2:end].decode(), content[end + 2:].decode()))
            client.sendall(bytes([0x40, 2]) + content[end:end + 2])
        elif kind == self.PINGREQ:
            client.sendall(bytes([0xd0, 0]))
        elif kind == self.DISCONNECT:
            self.ended = True


class WarnTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.sequence = cls.folder / "sequence"
        scene = ["--fps", "10", "--width", "320", "--height", "240", "--people", "2", "--camera", "xyz"]
        subprocess.run([PROGRAM, "simulate", "--frames", "50", *scene, "--out", cls.sequence], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def run_with(self, name, rules, *more):
        """Result of a run with rules."""
        file = self.folder / (name + ".yaml")
        file.write_text(rules)
        return subprocess.run([PROGRAM, "run", self.sequence, "--masks", self.sequence / "mask", "--zones", file, "--out",
                               self.folder / name, *more], capture_output=True, text=True, check=False)

    def events(self, name):
        return (self.folder / name / "events.jsonl").read_text().splitlines()

    def assert_ran(self, result):
        self.assertIn(result.returncode, (0, 3), result.stderr)

    def test_an_http_server_gets_every_event_once_and_in_order(self):
        with Receiver(statuses=[503]) as receiver:
            result = self.run_with("http", f"{ZONE}{NEAR}send: [{receiver.address()}]\n", "--hook-offset", "0,4,6")
            receiver.shutdown()
        self.assert_ran(result)
        lines = self.events("http")
        self.assertGreater(len(lines), 3)
        self.assertEqual([body for _, _, body in receiver.bodies], lines)
        self.assertEqual(receiver.bodies[0][:2], ("/warnings", "application/json"))
        self.assertIn(f"{receiver.address()}: {len(lines)} events sent\n", result.stdout)

    def test_receivers_that_are_away_mute_or_refuse_change_nothing_but_the_counts(self):
        with Receiver(statuses=[404] * 10000) as refusing, socket.create_server(("127.0.0.1", 0)) as mute:
            away = socket.socket()
            away.bind(("127.0.0.1", 0))  # it does not listen
            addresses = [refusing.address(), *(f"http://127.0.0.1:{s.getsockname()[1]}/" for s in (mute, away))]
            result = self.run_with("lost", f"{ZONE}{NEAR}send: [{', '.join(addresses)}]\n", "--hook-offset", "0,4,6")
            away.close()
            refusing.shutdown()
        self.assert_ran(result)
        plain = self.run_with("plain", ZONE + NEAR, "--hook-offset", "0,4,6")
        self.assert_ran(plain)
        lines = self.events("lost")
        self.assertEqual(lines, self.events("plain"))
        self.assertIn(f"{addresses[0]}: 0 events sent, {len(lines)} refused\n", result.stdout)
        for address in addresses[1:]:
            self.assertIn(f"{address}: 0 events sent, {len(lines)} dropped", result.stdout)

    def test_a_broker_gets_every_event(self):
        broker = Broker()
        result = self.run_with("mqtt", f"{ZONE}send: ['mqtt://me:secret@127.0.0.1:{broker.port}/site/warnings']\n")
        if "built without MQTT" in result.stderr:
            self.skipTest("skipped: the program was built without libmosquitto")
        self.assert_ran(result)
        broker.join(30)
        self.assertEqual(broker.messages, [("site/warnings", line) for line in self.events("mqtt")])
        self.assertIn(b"has ended unexpectedly", broker.connect)  # its last words
        self.assertTrue(broker.connect.endswith(b"\x00\x02me\x00\x06secret"))
        self.assertTrue(broker.ended)
        self.assertNotIn("secret", result.stdout)

    def test_silence_is_announced_at_the_end_and_while_no_image_comes(self):
        self.assert_ran(self.run_with("ended", ZONE))
        last = json.loads(self.events("ended")[-1])
        self.assertEqual((last["event"], last["kind"], last["rule"]), ("begin", "unknown", "the run has ended"))
        self.assert_ran(self.run_with("silent", ZONE, "--follow", "2"))
        self.assertIn("no image comes", {json.loads(line)["rule"] for line in self.events("silent")})

    def test_a_zone_behind_the_camera_is_announced_as_unseen(self):
        self.assert_ran(self.run_with("behind", "zones: [{name: back, polygon: [[-1, 1, -3], [1, 1, -3], [1, 1, -2]]}]\n"))
        first = json.loads(self.events("behind")[0])
        self.assertEqual((first["event"], first["kind"], first["rule"], first["frame"]), ("begin", "unseen", "back", 0))

    def test_a_finished_run_is_replayed_with_the_confidences_of_its_movers(self):
        self.assert_ran(self.run_with("replayed", ZONE))
        rules = self.folder / "replayed_near.yaml"
        rules.write_text(NEAR)
        out = self.folder / "again"
        subprocess.run([PROGRAM, "warn", self.folder / "replayed", "--zones", rules, "--hook-offset=0,4,6", "--out", out],
                       check=True, stdout=subprocess.DEVNULL)
        events = [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]
        self.assertEqual({event["rule"] for event in events if event["kind"] == "near"}, {"camera", "hook"})
        self.assertGreater(max(event.get("confidence", 0) for event in events), 0)

    def test_mistakes_have_a_fix(self):
        for name, rules, more, message in (
                ("disabled", ZONE, ["--set", "movers.enabled=false"], "movers.enabled=true"),
                ("nowhere", ZONE + "send: [nowhere]\n", [], "http://HOST:PORT/PATH"),
                ("no_hook", NEAR, [], "'to' names no point")):
            result = self.run_with(name, rules, *more)
            self.assertEqual(result.returncode, 1, name)
            self.assertIn(message, result.stderr)


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv[1]).resolve())
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
