"""ROS 2's side of `kittiwake ros-bridge`, by libraries of others: the types, their hashes and their bytes are those of rosbags, the transport is
Zenoh's own. It hears every topic, gives an order, and flies a mission as a client of the action does."""

import struct
import sys
import threading
import time
import uuid
from pathlib import Path

import numpy
import zenoh
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROUTER, MISSION = sys.argv[1:]
LIMIT_S = 120.0
STORE = get_typestore(Stores.ROS2_JAZZY)
PACKAGE = Path("clients/ros/kittiwake_msgs")

# What rosidl makes of an action and of a service.
goal, result, feedback = (PACKAGE / "action/FlyMission.action").read_text().split("---\n")
NAME = "kittiwake_msgs/action/FlyMission_"
UUID = "unique_identifier_msgs/UUID goal_id\n"
for name, text in {
    "unique_identifier_msgs/msg/UUID": "uint8[16] uuid\n",
    "action_msgs/msg/GoalInfo": UUID + "builtin_interfaces/Time stamp\n",
    "action_msgs/msg/GoalStatus": "action_msgs/GoalInfo goal_info\nint8 status\n",
    "action_msgs/msg/GoalStatusArray": "action_msgs/GoalStatus[] status_list\n",
    "action_msgs/msg/CancelGoal_Response": "int8 return_code\naction_msgs/GoalInfo[] goals_canceling\n",
    "std_srvs/msg/Trigger_Response": "bool success\nstring message\n",
    NAME + "Feedback": feedback,
    NAME + "FeedbackMessage": UUID + NAME + "Feedback feedback\n",
    NAME + "SendGoal_Request": UUID + goal,
    NAME + "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp\n",
    NAME + "GetResult_Request": UUID,
    NAME + "GetResult_Response": "int8 status\n" + result,
}.items():
    STORE.register(get_types_from_msg(text, name))


def written(name, **fields):
    return bytes(STORE.serialize_cdr(STORE.types[name](**fields), name))


def ros_name_of(kind):
    return kind.replace("::dds_::", "/").replace("::", "/").removesuffix("_")


def wait_for(what, condition):
    until = time.monotonic() + LIMIT_S
    while not (found := condition()):
        assert time.monotonic() < until, f"waited for {what}"
        time.sleep(0.05)
    return found


config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["{ROUTER}"]')
config.insert_json5("scouting/multicast/enabled", "false")
session = zenoh.open(config)


def fail(*error):
    """Its threads would keep the program alive."""
    sys.__excepthook__(*error)
    session.close()


sys.excepthook = fail

# The graph: a node with its publishers and services, as `ros2 node info` reads it.
tokens = [str(it.ok.key_expr) for it in session.liveliness().get("@ros2_lv/7/**") if it.ok]
kinds = {}
for token in tokens:
    parts = token.split("/")
    kinds.setdefault(parts[5], []).append(parts[9:12])
    assert parts[7:9] == ["%uav1", "kittiwake"], token
assert (len(kinds["NN"]), len(kinds["MP"]), len(kinds["SS"])) == (1, 8, 8), tokens
ends = {name.replace("%", "/"): (kind, hash_) for name, kind, hash_ in kinds["MP"] + kinds["SS"]}
for name, (kind, hash_) in ends.items():
    ros_name = ros_name_of(kind)
    if "/msg/" in ros_name or ros_name.endswith("FeedbackMessage"):
        assert STORE.hash_rihs01(ros_name) == hash_, f"{name} of {ros_name}"

heard = {}
lock = threading.Lock()


def on_sample(sample):
    _, *name, kind, hash_ = str(sample.key_expr).split("/")
    sequence, _, length = struct.unpack("<qqB", sample.attachment.to_bytes()[:17])
    assert length == 16 and len(sample.attachment.to_bytes()) == 33
    ros_name = ros_name_of(kind)
    message = STORE.deserialize_cdr(sample.payload.to_bytes(), ros_name)
    with lock:
        heard.setdefault("/" + "/".join(name), []).append((sequence, message))


subscriber = session.declare_subscriber("7/**", on_sample)


def ask(name, payload, response):
    kind, hash_ = ends[name]
    attachment = struct.pack("<qqB", 5, time.time_ns(), 16) + bytes(range(16))
    replies = session.get(f"7{name}/{kind}/{hash_}", payload=payload, attachment=attachment, timeout=LIMIT_S)
    reply = next(iter(replies)).ok
    assert reply.attachment.to_bytes() == attachment
    return STORE.deserialize_cdr(reply.payload.to_bytes(), response)


def newest(name):
    with lock:
        return heard.get(name, [(0, None)])[-1][1]


odometry = wait_for("the odometry", lambda: newest("/uav1/odometry"))
assert (odometry.header.frame_id, odometry.child_frame_id) == ("uav1/map", "uav1/base_link")
fix = wait_for("the fix", lambda: newest("/uav1/fix"))
assert fix.status.status == 0 and abs(fix.latitude) <= 90 and fix.position_covariance_type == 2
battery = wait_for("the battery", lambda: newest("/uav1/battery"))
assert 0 < battery.percentage <= 1 and battery.present and 5 < battery.voltage
names = wait_for("the diagnostics", lambda: newest("/diagnostics")).status
assert {"uav1: contact", "uav1: mission", "uav1: process mcm"} <= {it.name for it in names}, names

SEND, GET, CANCEL = (f"/uav1/fly_mission/_action/{it}" for it in ("send_goal", "get_result", "cancel_goal"))
FLYING = "/uav1/fly_mission/_action/feedback"


def new_goal():
    return STORE.types["unique_identifier_msgs/msg/UUID"](uuid=numpy.frombuffer(uuid.uuid4().bytes, dtype="uint8"))


def send(goal_id, mission):
    request = written(NAME + "SendGoal_Request", goal_id=goal_id, mission=mission)
    return ask(SEND, request, NAME + "SendGoal_Response").accepted


def result_of(goal_id):
    return ask(GET, written(NAME + "GetResult_Request", goal_id=goal_id), NAME + "GetResult_Response")


def trigger(name):
    return ask(name, b"\0\1\0\0\0", "std_srvs/msg/Trigger_Response")


def decided(text):
    wait_for(f"a decision with `{text}`", lambda: [it for _, it in heard.get("/uav1/decisions", []) if text in it.msg])


# A goal without a valid mission is refused with its reason; a valid one flies.
mission = Path(MISSION).read_text()
assert not send(new_goal(), "name = 3")
decided("refused: ")
first = new_goal()
assert send(first, mission)
wait_for("it to fly", lambda: (it := newest(FLYING)) and it.feedback.phase == "nominal")
wait_for("a plan", lambda: 1 < len(newest("/uav1/plan").poses))
climbing = wait_for("a climb", lambda: (it := newest("/uav1/odometry")) and 2 < it.pose.pose.position.z and it)
assert abs(sum(getattr(climbing.pose.pose.orientation, it) ** 2 for it in "xyzw") - 1) < 1e-3

# Orders, as under the bridge's token.
paused = trigger("/uav1/pause")
assert paused.success, paused.message
decided("operator_pause")
resumed = trigger("/uav1/resume")
assert resumed.success, resumed.message
again = trigger("/uav1/resume")
assert not again.success and again.message

end = result_of(first)
assert (end.status, end.outcome) == (4, "success"), end
assert end.objectives_achieved == end.objectives > 0

# A goal that is canceled flies home.
second = new_goal()
assert send(second, mission)
wait_for("it to fly", lambda: bytes(newest(FLYING).goal_id.uuid) == bytes(second.uuid))
wait_for("it to be away", lambda: 20 < newest("/uav1/odometry").pose.pose.position.x)
info = STORE.types["action_msgs/msg/GoalInfo"](goal_id=second, stamp=odometry.header.stamp)
canceled = ask(CANCEL, bytes(STORE.serialize_cdr(info, "action_msgs/msg/GoalInfo")), "action_msgs/msg/CancelGoal_Response")
assert canceled.return_code == 0 and len(canceled.goals_canceling) == 1
end = result_of(second)
assert end.status == 5 and end.reason, end
home = newest("/uav1/odometry").pose.pose.position
assert abs(home.x) < 3 and abs(home.y) < 3, home


def states():
    return [[it.status for it in it.status_list] for _, it in heard["/uav1/fly_mission/_action/status"]]


wait_for("each state of both goals", lambda: states() == [[1], [2], [4], [4, 1], [4, 2], [4, 3], [4, 5]])
for name, messages in list(heard.items()):
    numbers = [sequence for sequence, _ in messages]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), f"{name}: {numbers}"
print("ROS 2: " + ", ".join(f"{len(messages)} on {name}" for name, messages in sorted(heard.items())))
session.close()
