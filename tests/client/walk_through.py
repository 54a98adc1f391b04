"""Flies a mission with a client that was generated from /openapi.json, by nothing but its types.

Called by `.ci/client` with the gateway's address and an operator's token; the generated package `client` lies on the path.
"""

import sys
import time
import uuid

from client import AuthenticatedClient
from client.api.orders import post_vehicles_id_pause, post_vehicles_id_resume
from client.api.vehicles import get_vehicles, get_vehicles_id, post_vehicles_id_command_take
from client.models import (
    KittiwakeV1Fleet,
    KittiwakeV1MissionOutcome,
    KittiwakeV1MissionPhase,
    KittiwakeV1OrderDone,
    KittiwakeV1Problem,
    KittiwakeV1Vehicle,
)

LIMIT_S = 240


def entry(client, name):
    """The vehicle's line in the fleet."""
    fleet = get_vehicles.sync(client=client)
    assert isinstance(fleet, KittiwakeV1Fleet), fleet
    return next((it for it in fleet.vehicles if name in (None, it.vehicle)), None)


def until(client, name, what, holds):
    """Asks until `holds` of the vehicle's line; says what was waited for if it never does."""
    deadline = time.monotonic() + LIMIT_S
    while time.monotonic() < deadline:
        line = entry(client, name)
        if line is not None and holds(line):
            print(f"{what}: yes")
            return line
        time.sleep(0.05)
    sys.exit(f"{what}: not within {LIMIT_S} s; the vehicle: {line}")


def ordered(answer):
    """The gateway's answer to an order, which a problem is not."""
    assert isinstance(answer, KittiwakeV1OrderDone), answer


def main(url, token):
    with AuthenticatedClient(base_url=url, token=token) as client:
        name = until(client, None, "a vehicle is there", lambda it: True).vehicle

        problem = get_vehicles_id.sync("nobody", client=client)
        assert isinstance(problem, KittiwakeV1Problem), problem
        assert problem.status == 404 and problem.type_ == "urn:kittiwake:problem:no-such-vehicle", problem

        until(client, name, "it flies", lambda it: it.flying is True)
        ordered(post_vehicles_id_pause.sync(name, client=client, idempotency_key=str(uuid.uuid4())))
        until(client, name, "it holds for the operator", lambda it: it.acting == "operator_pause")
        state = get_vehicles_id.sync(name, client=client)
        assert isinstance(state, KittiwakeV1Vehicle), state
        assert state.contingencies.acting == "operator_pause", state.contingencies
        taken = post_vehicles_id_command_take.sync(name, client=client)
        assert not isinstance(taken, KittiwakeV1Problem), taken
        ordered(post_vehicles_id_resume.sync(name, client=client, idempotency_key=str(uuid.uuid4())))
        done = until(client, name, "the mission is over", lambda it: it.phase == KittiwakeV1MissionPhase.MISSION_PHASE_OVER)
        assert done.outcome == KittiwakeV1MissionOutcome.MISSION_OUTCOME_SUCCESS, done


main(*sys.argv[1:])
