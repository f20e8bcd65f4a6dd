#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Warnings of a run, and their delivery by HTTP and MQTT to receivers on this computer.

  apps/warn_test.py PROGRAM     PROGRAM: the built command
"""
import http.server
import json
import os
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from lab.browser import WebSocket

PROGRAM = ""
ZONE = "zones: [{name: gate, polygon: [[-1, 1, 1], [1, 1, 1], [1, 1, 3], [-1, 1, 3]]}]\n"
NEAR = "distances: [{to: camera, nearer: 30}, {to: hook, nearer: 30, level: true}]\n"


class Receiver(http.server.ThreadingHTTPServer):
    """An HTTP server that keeps the bodies of the requests, and refuses the first ones, or answers late [s]."""

    def __init__(self, statuses=(), late=0, tls=None):
        super().__init__(("127.0.0.1", 0), Handler)
        self.bodies, self.statuses, self.late, self.tls = [], list(statuses), late, tls
        if tls:
            self.socket = tls.wrap_socket(self.socket, server_side=True)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def address(self):
        return f"{'https' if self.tls else 'http'}://127.0.0.1:{self.server_address[1]}/warnings"


class Handler(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"])).decode()
        status = self.server.statuses.pop(0) if self.server.statuses else 204
        if status == 204:
            self.server.bodies.append((self.path, self.headers["Content-Type"], body))
        time.sleep(self.server.late)
        self.send_response(status)
        self.end_headers()

    def log_message(self, *_):
        pass


class Broker(threading.Thread):
    """The little of an MQTT 3.1.1 broker that one publisher needs."""

    CONNECT, PUBLISH, PINGREQ, DISCONNECT = 1, 3, 12, 14

    def __init__(self, tls=None):
        super().__init__(daemon=True)
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        if tls:
            self.listener = tls.wrap_socket(self.listener, server_side=True)
        self.connect, self.messages, self.ended = b"", [], False
        self.start()

    def run(self):
        client = None
        while client is None:
            try:
                client = self.listener.accept()[0]
            except ssl.SSLError:  # a client that does not trust the certificate
                continue
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

    def run_with(self, name, rules, *more, trusted=None):
        """Result of a run with rules; `trusted` is a file of certificates in place of those of the system."""
        file = self.folder / (name + ".yaml")
        file.write_text(rules)
        return subprocess.run([PROGRAM, "run", self.sequence, "--masks", self.sequence / "mask", "--zones", file, "--out",
                               self.folder / name, *more], capture_output=True, text=True, check=False,
                              env={**os.environ, **({"SSL_CERT_FILE": str(trusted)} if trusted else {})})

    def events(self, name):
        return (self.folder / name / "events.jsonl").read_text().splitlines()

    def without_run(self, texts):
        """Events that a receiver got, without the name of the run, which they share, and the time of day."""
        events = [json.loads(text) for text in texts]
        for event in events:
            self.assertLess(abs(event.pop("sent") - time.time()), 3600)
        self.assertEqual(len({event.pop("run") for event in events}), 1)
        return events

    def assert_ran(self, result):
        self.assertIn(result.returncode, (0, 3), result.stderr)

    def test_an_http_server_gets_every_event_once_and_in_order(self):
        with Receiver(statuses=[503]) as receiver:
            result = self.run_with("http", f"{ZONE}{NEAR}send: [{receiver.address()}]\n", "--hook-offset", "0,4,6")
            receiver.shutdown()
        self.assert_ran(result)
        lines = self.events("http")
        self.assertGreater(len(lines), 3)
        self.assertEqual(self.without_run([body for _, _, body in receiver.bodies]), [json.loads(line) for line in lines])
        self.assertEqual([json.loads(line)["id"] for line in lines], list(range(1, len(lines) + 1)))
        self.assertEqual(receiver.bodies[0][:2], ("/warnings", "application/json"))
        self.assertIn(f"{receiver.address()}: {len(lines)} events sent\n", result.stdout)

    def test_an_http_server_that_answers_late_gets_every_event_once(self):
        with Receiver(late=2.5) as receiver:
            result = self.run_with("late", "zones: [{name: back, polygon: [[-1, 1, -3], [1, 1, -3], [1, 1, -2]]}]\n"
                                   f"send: [{receiver.address()}]\n")
            receiver.shutdown()
        self.assert_ran(result)
        bodies = [json.loads(body) for _, _, body in receiver.bodies]
        self.assertEqual([body["id"] for body in bodies], list(range(1, len(bodies) + 1)))
        self.assertIn(f"{receiver.address()}: {len(bodies)} events sent", result.stdout)

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
        self.assertEqual(result.returncode, 3)
        for address in addresses:
            self.assertIn(f"{address} got none of {len(lines)} events", result.stdout + result.stderr)

    def test_a_broker_gets_every_event(self):
        broker = Broker()
        result = self.run_with("mqtt", f"{ZONE}send: ['mqtt://me:secret@127.0.0.1:{broker.port}/site/crane 1']\n")
        if "built without MQTT" in result.stderr:
            self.skipTest("skipped: the program was built without libmosquitto")
        self.assert_ran(result)
        broker.join(30)
        self.assertEqual({topic for topic, _ in broker.messages}, {"site/crane 1"})
        self.assertEqual(self.without_run([text for _, text in broker.messages]), [json.loads(line) for line in self.events("mqtt")])
        self.assertIn(b"has ended unexpectedly", broker.connect)  # its last words
        self.assertTrue(broker.connect.endswith(b"\x00\x02me\x00\x06secret"))
        self.assertTrue(broker.ended)
        self.assertNotIn("secret", result.stdout)

    def certificate(self, name):
        """A file with a certificate for a host and its key, and the settings of a server that has them."""
        file = self.folder / "certificate.pem"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=test",
                        "-addext", f"subjectAltName={name}", "-keyout", file, "-out", self.folder / "public.pem"],
                       check=True, capture_output=True)
        file.write_text(file.read_text() + (self.folder / "public.pem").read_text())
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        tls.load_cert_chain(file)
        return file, tls

    @unittest.skipUnless(shutil.which("openssl"), "skipped: there is no openssl")
    def test_encrypted_receivers_get_every_event_if_their_certificate_is_trusted(self):
        for name, trusts, reaches in (("IP:127.0.0.1", True, True), ("IP:127.0.0.1", False, False), ("DNS:elsewhere", True, False)):
            with self.subTest(name=name, trusts=trusts):
                file, tls = self.certificate(name)
                broker = Broker(tls)
                topic = f"mqtts://127.0.0.1:{broker.port}/site"
                with Receiver(tls=tls) as receiver:
                    result = self.run_with("tls", f"{ZONE}send: [{receiver.address()}, '{topic}']\n", trusted=file if trusts else None)
                    receiver.shutdown()
                if "built without MQTT" in result.stderr:
                    self.skipTest("skipped: the program was built without libmosquitto")
                self.assert_ran(result)
                lines = [json.loads(line) for line in self.events("tls")]
                if reaches:
                    broker.join(30)
                    self.assertEqual(self.without_run([body for _, _, body in receiver.bodies]), lines)
                    self.assertEqual(self.without_run([text for _, text in broker.messages]), lines)
                    continue
                self.assertEqual((receiver.bodies, broker.connect, broker.messages), ([], b"", []))
                for address in (receiver.address(), topic):
                    self.assertRegex(result.stdout, f"{address}: 0 events sent, {len(lines)} dropped: .*certificate")

    def test_silence_is_announced_at_the_end_and_while_no_image_comes(self):
        self.assert_ran(self.run_with("ended", ZONE))
        last = json.loads(self.events("ended")[-1])
        self.assertEqual((last["event"], last["kind"], last["rule"]), ("begin", "unknown", "the run has ended"))
        self.assert_ran(self.run_with("silent", ZONE, "--follow", "2"))
        self.assertIn("no image was processed for 1 s", {json.loads(line)["rule"] for line in self.events("silent")})

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

    def test_a_run_keeps_its_rules_and_its_events(self):
        self.assert_ran(self.run_with("kept", ZONE + NEAR, "--hook-offset", "0,4,6"))
        run, before = self.folder / "kept", self.events("kept")
        self.assertIn('"offset":[0.0,4.0,6.0]', (run / "zones.yaml").read_text())
        refused = subprocess.run([PROGRAM, "warn", run], capture_output=True, text=True, check=False)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("--force", refused.stderr)
        self.assertEqual(self.events("kept"), before)
        out = self.folder / "kept_again"
        subprocess.run([PROGRAM, "warn", run, "--out", out], check=True, stdout=subprocess.DEVNULL)
        rules = {event["rule"] for event in map(json.loads, (out / "events.jsonl").read_text().splitlines()) if event["kind"] == "near"}
        self.assertEqual(rules, {"camera", "hook"})
        self.assertEqual((out / "zones.yaml").read_text(), (run / "zones.yaml").read_text())
        subprocess.run([PROGRAM, "warn", run, "--force"], check=True, stdout=subprocess.DEVNULL)
        self.assertEqual(self.events("kept"), (out / "events.jsonl").read_text().splitlines())

    def shown(self, *arguments, kinds=("zones", "points", "events", "summary")):
        """The messages of the page of a finished run, by their type."""
        with subprocess.Popen([PROGRAM, "view", *arguments, "--port", "0"], stdout=subprocess.PIPE, text=True) as viewed:
            try:
                port = viewed.stdout.readline().split(":")[3].split("/")[0]
                page, messages = WebSocket(f"ws://127.0.0.1:{port}/data"), {}
                while not set(kinds) <= messages.keys():
                    if isinstance(text := page.receive(), str):
                        messages[json.loads(text)["type"]] = json.loads(text)
                page.close()
            finally:
                viewed.terminate()
        return messages

    def zones_and_events(self, *arguments):
        messages = self.shown(*arguments)
        return [zone["name"] for zone in messages["zones"]["zones"]], messages["events"]["events"]

    def test_the_page_of_a_run_shows_its_rules_or_the_events_of_others(self):
        self.assert_ran(self.run_with("viewed", ZONE))
        zones, events = self.zones_and_events(self.folder / "viewed")
        self.assertEqual(zones, ["gate"])
        self.assertIn("the run has ended", {event["rule"] for event in events})
        before = self.events("viewed")
        other = self.folder / "other.yaml"
        other.write_text(ZONE.replace("gate", "door") + "distances: [{to: camera, nearer: 30}]\n")
        zones, events = self.zones_and_events(self.folder / "viewed", "--zones", other)
        self.assertEqual(zones, ["door"])
        self.assertEqual({event["rule"] for event in events} - {"door"}, {"camera"})
        self.assertEqual(self.events("viewed"), before)

    def test_the_hook_of_the_page_may_be_elsewhere_or_have_no_rule(self):
        run = self.folder / "moved"
        self.assert_ran(self.run_with("moved", ZONE + NEAR, "--hook-offset", "0,4,6"))
        near = {event["rule"] for event in map(json.loads, self.events("moved")) if event["kind"] == "near"}
        self.assertEqual(near, {"camera", "hook"})
        messages = self.shown(run, "--hook-offset", "500,0,0")
        self.assertIn([500, 0, 0], [point["offset"] for point in messages["points"]["points"]])
        self.assertEqual({event["rule"] for event in messages["events"]["events"] if event["kind"] == "near"}, {"camera"})

        subprocess.run([PROGRAM, "run", self.sequence, "--count", "20", "--out", self.folder / "ruleless"], check=False,
                       stdout=subprocess.DEVNULL)
        messages = self.shown(self.folder / "ruleless", "--hook-offset", "0,4,6", kinds=["points", "zones", "summary"])
        self.assertEqual([(point["name"], point["offset"], point["nearer"]) for point in messages["points"]["points"]],
                         [("hook", [0, 4, 6], 0)])
        self.assertEqual(messages["zones"]["zones"], [])

    def test_events_are_lines_of_json_on_standard_output(self):
        result = self.run_with("lines", ZONE + NEAR, "--hook-offset", "0,4,6", "--events", "-")
        self.assert_ran(result)
        self.assertEqual(result.stdout.splitlines(), self.events("lines"))
        self.assertIn("trajectory.txt", result.stderr)
        shown = subprocess.run([PROGRAM, "warn", self.folder / "lines", "--events", "-", "--force"], capture_output=True,
                               text=True, check=True)
        self.assertEqual(shown.stdout.splitlines(), self.events("lines"))

    def test_a_rule_for_a_class_that_cannot_be_is_refused(self):
        zone = ZONE.replace("}]\n", ", classes: [CLASS]}]\n")
        self.assert_ran(self.run_with("person", zone.replace("CLASS", "person")))
        for arguments in (["run", self.sequence, "--masks", self.sequence / "mask", "--out", self.folder / "no"],
                          ["warn", self.folder / "person", "--out", self.folder / "no"]):
            result = self.refused(zone.replace("CLASS", "persn"), *arguments)
            self.assertIn("did you mean 'person'", result.stderr)
        result = self.refused(zone.replace("CLASS", "person"), "run", self.sequence, "--out", self.folder / "no")
        self.assertIn("neither a network nor masks", result.stderr)

    def refused(self, rules, *arguments):
        file = self.folder / "refused.yaml"
        file.write_text(rules)
        result = subprocess.run([PROGRAM, *arguments, "--zones", file], capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 1)
        self.assertIn("refused.yaml", result.stderr)
        return result

    def test_zones_without_up_below_a_camera_that_looks_down_are_doubtful(self):
        yard = self.folder / "yard"
        scene = ["--scene", "yard", "--camera", "trolley", "--people", "1", "--width", "320", "--height", "240", "--frames", "60"]
        subprocess.run([PROGRAM, "simulate", *scene, "--out", yard], check=True, capture_output=True)
        rules = self.folder / "level.yaml"
        for up, code in (("", 3), ("up: [0, -0.743, -0.669]\n", 0)):
            rules.write_text(up + "distances: [{to: camera, nearer: 1}]\n")
            result = subprocess.run([PROGRAM, "run", yard, "--masks", yard / "mask", "--zones", rules, "--force", "--out",
                                     self.folder / "tilted"], capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertEqual("the floor is tilted by 42 degrees; add the line 'up:" in result.stderr + result.stdout, code == 3)

    def test_mistakes_have_a_fix(self):
        for name, rules, more, message in (
                ("hook", NEAR, ["--hook-offset", "0,nan,6"], "give RIGHT,DOWN,AHEAD"),
                ("disabled", ZONE, ["--set", "movers.enabled=false"], "movers.enabled=true"),
                ("nowhere", ZONE + "send: [nowhere]\n", [], "http://HOST:PORT/PATH"),
                ("no_hook", NEAR, [], "'to' names no point")):
            result = self.run_with(name, rules, *more)
            self.assertEqual(result.returncode, 1, name)
            self.assertIn(message, result.stderr)


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv[1]).resolve())
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
