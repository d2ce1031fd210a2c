"""A robot under EGM, with the messages of a package by others (ABBRobotEGM or abb_robot_client).

Arguments: port, `egm` or `egm-path`, cycles, package. Prints one JSON document.
"""
import importlib
import json
import math
import socket
import sys
import time

# Both packages register the same file of messages: one a process.
egm_pb2 = importlib.import_module(sys.argv[4] + "._egm_protobuf.egm_pb2")
port, door, cycles = int(sys.argv[1]), sys.argv[2], int(sys.argv[3])
cycle_ms = 4 if door == "egm" else 48
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.settimeout(cycle_ms * 1e-3)


def pose(message, place):
    message.pos.x, message.pos.y, message.pos.z = place
    message.orient.u0, message.orient.u1, message.orient.u2, message.orient.u3 = 0.0, 1.0, 0.0, 0.0


answered, in_order, largest, kinds, last = 0, True, 0.0, set(), -1
for cycle in range(cycles):
    begun = time.monotonic()
    # At rest first: that is when the door begins to delay.
    t = max(0.0, cycle * cycle_ms * 1e-3 - 0.5)
    angle = t * t if t < 1.0 else 2.0 * t - 1.0
    place = (100.0 * math.cos(angle), 100.0 * math.sin(angle), 0.0)
    robot = egm_pb2.EgmRobot()
    robot.header.seqno, robot.header.tm, robot.header.mtype = cycle, cycle * cycle_ms, 2
    pose(robot.feedBack.cartesian, place)
    pose(robot.planned.cartesian, place)
    robot.motorState.state, robot.mciState.state, robot.rapidExecState.state = 1, 3, 2
    # What comes after its cycle is for nobody.
    link.setblocking(False)
    try:
        while True:
            link.recvfrom(65535)
    except BlockingIOError:
        pass
    link.settimeout(cycle_ms * 1e-3)
    link.sendto(robot.SerializeToString(), ("127.0.0.1", port))
    try:
        data, _ = link.recvfrom(65535)
    except socket.timeout:
        continue
    sensor = egm_pb2.EgmSensor() if door == "egm" else egm_pb2.EgmSensorPathCorr()
    sensor.ParseFromString(data)
    if door == "egm":
        got = sensor.planned.cartesian.pos
        largest = max(largest, math.dist((got.x, got.y, got.z), place))
        in_order &= sensor.planned.cartesian.orient.u1 == 1.0
    else:
        largest = max(largest, abs(sensor.pathCorr.pos.y))
    in_order &= sensor.header.seqno > last
    last = sensor.header.seqno
    kinds.add(sensor.header.mtype)
    answered += 1
    time.sleep(max(0.0, cycle_ms * 1e-3 - (time.monotonic() - begun)))
print(json.dumps({"cycles": cycles, "answered": answered, "in_order": in_order, "kinds": sorted(kinds), "largest_mm": largest}))
