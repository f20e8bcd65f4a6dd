# SPDX-License-Identifier: Apache-2.0
"""Messages of several topics that belong together, and their queue to the tracker."""
import collections
import threading

from stillmap_ros.images import nanoseconds

SET_BACK = 10**9  # a stamp this much earlier than one before means that the clock was set back [ns]
WAITING = 30  # messages of a topic that wait for their partners in realtime; a depth camera may be a second late
QUEUE = 60  # sets that wait in lockstep before the receiving thread does


class Pairing:
    """Sets of messages whose stamps differ by at most `slop` [s]. The first topic gives the stamp of a set."""

    def __init__(self, topics, slop, lossless):
        self.slop, self.lossless = slop * 1e9, lossless
        self.waiting = [collections.deque() for _ in range(topics)]
        self.newest = [0] * topics  # stamps [ns]
        self.unpaired = 0  # messages of the first topic without a partner

    def add(self, topic, message):
        """Adds a message. Returns the sets that are complete now."""
        stamp = nanoseconds(message.header.stamp)
        if stamp < self.newest[topic] - SET_BACK:
            self.waiting = [collections.deque(m for m in queue if m[0] <= stamp + SET_BACK) for queue in self.waiting]
        self.newest[topic] = stamp
        self.waiting[topic].append((stamp, message))
        if len(self.waiting[topic]) > WAITING and not self.lossless:
            self.waiting[topic].popleft()
            self.unpaired += topic == 0
        complete = []
        while self.waiting[0]:
            found = self._partners(self.waiting[0][0][0])
            if found is None:
                break
            first = self.waiting[0].popleft()[1]
            if found:
                complete.append((first, *found))
            else:
                self.unpaired += 1
        return complete

    def _partners(self, stamp):
        """Returns the nearest message of each other topic, nothing if one has none, None while it may still come."""
        partners = []
        for queue in list(self.waiting)[1:]:
            while len(queue) > 1 and abs(queue[1][0] - stamp) <= abs(queue[0][0] - stamp):
                queue.popleft()
            near = bool(queue) and abs(queue[0][0] - stamp) <= self.slop
            exact = near and queue[0][0] == stamp
            if not exact and not (queue and queue[-1][0] > stamp):
                return None
            partners.append(queue[0][1] if near else None)
        return [] if None in partners else partners


class Queue:
    """Hands sets from the thread that receives to the one that tracks: all of them, or the newest only."""

    def __init__(self, lossless):
        self.lossless = lossless
        self.sets = collections.deque()
        self.dropped = 0
        self.closed = False
        self.changed = threading.Condition()

    def put(self, item):
        with self.changed:
            if self.lossless:
                self.changed.wait_for(lambda: len(self.sets) < QUEUE or self.closed)
            else:
                self.dropped += len(self.sets)
                self.sets.clear()
            self.sets.append(item)
            self.changed.notify_all()

    def get(self, timeout):
        """Returns the next set, or None after the time [s] or wake()."""
        with self.changed:
            if not self.sets and not self.closed:
                self.changed.wait(timeout)
            if not self.sets:
                return None
            item = self.sets.popleft()
            self.changed.notify_all()
            return item

    def clear(self):
        with self.changed:
            self.sets.clear()
            self.changed.notify_all()

    def wake(self):
        with self.changed:
            self.changed.notify_all()

    def close(self):
        with self.changed:
            self.closed = True
            self.changed.notify_all()
