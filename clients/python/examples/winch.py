"""A winch that is not there: it takes the time of one, and says what it does.

Its declaration is config/skills/winch_down.toml; config/missions/winch.toml uses it.
"""

from kittiwake.skill import Task, offer

METRES_PER_SECOND = 1.0
STEP_S = 0.1


def winch_down(task: Task) -> str:
    length_m, out_m = task.inputs["length_m"], 0.0
    print(f"lowers the load by {length_m:.0f} m", flush=True)
    while out_m < length_m:
        if task.sleep(STEP_S):
            print("interrupted: drops the rope", flush=True)
            return "cancelled"
        out_m += METRES_PER_SECOND * STEP_S
        task.progress = out_m / length_m
    task.results["rope_m"] = out_m
    print("unhooked, and the rope is in", flush=True)
    return "delivered"


if __name__ == "__main__":
    offer("winch_down", winch_down)
