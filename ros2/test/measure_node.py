# SPDX-License-Identifier: Apache-2.0
"""Delay and CPU time of the node with a camera of 640 x 480 pixels at 30 Hz, printed.

  python3 ros2/test/run_tests.py --venv build/ros_venv --package build/release/python --command build/release/stillmap \\
      ros2/test/measure_node.py -s
"""
import json
import re

import numpy as np
import pytest
from conftest import command, stop
from stillmap_ros.images import nanoseconds

FRAMES, PASSES = 150, 4
# The node, which counts the CPU time of its Python threads outside Slam.push(), of the middleware, and of all.
NODE = """
import json, os, threading, time
from stillmap_ros import mapper, node
inside, before = [0.0, 0], {}

class Timed:
    def __init__(self, slam):
        self.slam = slam
    def __getattr__(self, name):
        return getattr(self.slam, name)
    def push(self, *frame):
        if inside[1] == 0:  # Python's start and that of the node are not counted.
            before.update(seconds())
        begin = time.thread_time()
        result = self.slam.push(*frame)
        inside[0] += time.thread_time() - begin
        inside[1] += 1
        return result

def seconds_of(task):
    times = open(f'/proc/self/task/{task}/stat').read().rsplit(')', 1)[1].split()
    return (int(times[11]) + int(times[12])) / os.sysconf('SC_CLK_TCK')

def seconds():
    own = {thread.native_id: thread.name for thread in threading.enumerate()}
    tasks = {int(task): open(f'/proc/self/task/{task}/comm').read() for task in os.listdir('/proc/self/task')}
    spent = {name: seconds_of(task) for task, name in own.items()}
    spent['middleware'] = sum(seconds_of(task) for task, name in tasks.items() if task not in own and name.startswith('dds'))
    spent['all'] = time.process_time()
    return spent

make, close = mapper.Mapper.__init__, node.StillmapNode.close
def made(self, *words, **more):
    make(self, *words, **more)
    self.slam = Timed(self.slam)
def closed(self):
    spent = {name: s - before.get(name, 0) for name, s in seconds().items()}
    spent['tracking'] -= inside[0]
    print('MEASURED', json.dumps({name: 1000 * seconds / inside[1] for name, seconds in spent.items()}))
    close(self)
mapper.Mapper.__init__, node.StillmapNode.close = made, closed
node.main()
"""


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("simulated") / "sequence"
    command("simulate", "--people", 2, "--frames", FRAMES, "--out", folder)
    return folder


def test_delay_and_load(processes, robot, recording):
    node = processes.start("node", "-c", NODE, "--ros-args", "-p", "map_period:=2.0")
    processes.camera(recording, "--now", "--repeat", PASSES)
    assert robot.spin_until(lambda: robot.says("no images for"), 120), node.log.read_text()
    values, _ = robot.values()
    delays = 1000 * np.array([arrived - nanoseconds(m.header.stamp) / 1e9
                              for arrived, m in zip(robot.times["pose"], robot.got["pose"])])
    log = stop(node)
    spent = json.loads(re.search("MEASURED (.*)", log).group(1))
    print(f"\nframes: {values['frames received']} received, {values['frames dropped']} dropped"
          f"\ndelay from the stamp to the received pose: median {np.median(delays):.0f} ms, p95 {np.quantile(delays, 0.95):.0f} ms"
          "\nCPU time per frame by thread, without Slam.push() [ms]: " + ", ".join(f"{name} {t:.1f}" for name, t in spent.items()))
