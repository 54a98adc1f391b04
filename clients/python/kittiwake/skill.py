"""A skill of one's own: `offer` carries out the tasks that a vehicle orders. docs/skills.md describes the exchange.

The bus needs nothing of this file but what it writes and reads: the two messages of `kittiwake.v1.skill`, on two keys.
"""

import argparse
import json
import threading
import time
from typing import Callable, Dict, Optional, Union

import zenoh

from kittiwake.v1 import skill_pb2 as pb

# A vehicle takes a process for lost that it has not heard for three seconds.
PERIOD_S = 0.5


class Task:
    """One order, and how it goes on."""

    def __init__(self, order: pb.TaskOrder):
        self.request_id = order.request_id
        #: A number or a text for each input of the declaration.
        self.inputs: Dict[str, Union[float, str]] = {it.name: it.text or it.value for it in order.inputs}
        #: Set when the task is to end: the vehicle waits `interrupt_s` of the declaration, and flies on.
        self.cancelled = threading.Event()
        #: What was found out: told with the outcome.
        self.results: Dict[str, float] = {}
        #: From 0 to 1.
        self.progress = 0.0
        #: Why it ended as it did, for people.
        self.reason = ""
        #: Empty while it runs.
        self.outcome = ""

    def sleep(self, seconds: float) -> bool:
        """Waits; returns whether the task was cancelled meanwhile."""
        return self.cancelled.wait(seconds)


class _Process:
    def __init__(self, session, vehicle: str, name: str, version: int, do: Callable[[Task], str]):
        self.name, self.version, self.do = name, version, do
        self.task: Optional[Task] = None
        self.changed = threading.Event()
        self.lock = threading.Lock()
        self.reports = session.declare_publisher(f"kw/{vehicle}/task/report")
        self.orders = session.declare_subscriber(f"kw/{vehicle}/task/order", self.on_order)

    def on_order(self, sample) -> None:
        order = pb.TaskOrder.FromString(sample.payload.to_bytes())
        if order.skill != self.name:
            return
        with self.lock:
            present = self.task
            is_known = present and present.request_id == order.request_id
            if order.cancel and is_known:
                present.cancelled.set()
            elif not order.cancel and not is_known:
                # Another order: the one before was given up.
                if present:
                    present.cancelled.set()
                self.task = Task(order)
                threading.Thread(target=self.carry_out, args=(self.task, present), daemon=True).start()
        self.changed.set()

    def carry_out(self, task: Task, before: Optional[Task]) -> None:
        while before and not before.outcome:
            time.sleep(0.05)
        try:
            outcome = self.do(task)
            task.results = {name: float(value) for name, value in task.results.items()}
            if not isinstance(outcome, str) or not outcome:
                raise TypeError(f"`do` returned {outcome!r}, expected an outcome of the declaration, or \"cancelled\"")
        except BaseException as error:  # The vehicle must know, whatever it is.
            outcome, task.reason, task.results = "error", f"{type(error).__name__}: {error}", {}
            print(f"{self.name}: {task.reason}", flush=True)
        task.outcome = outcome
        self.changed.set()

    def report(self) -> None:
        report = pb.TaskReport(skill=self.name, version=self.version, state=pb.TASK_STATE_READY)
        task = self.task
        if task:
            outcome = task.outcome  # Once: it may end meanwhile.
            report.request_id, report.progress, report.reason = task.request_id, task.progress, task.reason
            report.state = pb.TASK_STATE_ENDED if outcome else pb.TASK_STATE_RUNNING
            report.outcome = outcome
            if outcome:
                report.results.extend(pb.TaskValue(name=name, value=it) for name, it in task.results.items())
        self.reports.put(report.SerializeToString())


def offer(name: str, do: Callable[[Task], str], version: int = 1, connect: Optional[str] = None,
          vehicle: str = "uav1") -> None:
    """Carries out the tasks of skill `name` by `do`, which returns the outcome, until the program is ended.

    `version` is that of the declaration that `do` was written for. Without `connect`, the router's locator and the vehicle's
    name come from the command line.
    """
    if not connect:
        arguments = argparse.ArgumentParser(description=f"Carries out the skill `{name}` of a Kittiwake vehicle.")
        arguments.add_argument("--connect", required=True, help="the router, as `kittiwake up` prints it")
        arguments.add_argument("--vehicle", default=vehicle)
        given = arguments.parse_args()
        connect, vehicle = given.connect, given.vehicle
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    try:
        config.insert_json5("connect/endpoints", json.dumps([connect]))
    except zenoh.ZError:
        raise SystemExit(f"`{connect}` does not name a router: expected its locator, as `kittiwake up` prints it") from None
    config.insert_json5("connect/timeout_ms", "-1")
    config.insert_json5("scouting/multicast/enabled", "false")
    print(f"waits for the router at {connect}", flush=True)
    with zenoh.open(config) as session:
        process = _Process(session, vehicle, name, version, do)
        print(f"offers {name} to {vehicle}", flush=True)
        while True:
            process.report()
            process.changed.wait(PERIOD_S)
            process.changed.clear()
