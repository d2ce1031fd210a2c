"""A robot under EGM, with the messages of ABBRobotEGM and abb_robot_client: each reads what the other side of the door wrote.

Arguments: port, `egm` or `egm-path`, cycles. Prints one JSON document.
"""
import json
import math
import socket
import sys
import time

from ABBRobotEGM._egm_protobuf import egm_pb2
from abb_robot_client._egm_protobuf import egm_pb2 as other_pb2

port, door, cycles = int(sys.argv[1]), sys.argv[2], int(sys.argv[3])
cycle_ms = 4 if door == "egm" else 48
link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.settimeout(cycle_ms * 1e-3)


def pose(message, place):
    message.pos.x, message.pos.y, message.pos.z = place
    message.orient.u0, message.orient.u1, message.orient.u2, message.orient.u3 = 0.0, 1.0, 0.0, 0.0


answered, in_order, largest, kinds = 0, True, 0.0, set()
for cycle in range(cycles):
    begun = time.monotonic()
    t = cycle * cycle_ms * 1e-3
    angle = t * t if t < 1.0 else 2.0 * t - 1.0
    place = (100.0 * math.cos(angle), 100.0 * math.sin(angle), 0.0)
    robot = egm_pb2.EgmRobot()
    robot.header.seqno, robot.header.tm, robot.header.mtype = cycle, cycle * cycle_ms, 2
    pose(robot.feedBack.cartesian, place)
    pose(robot.planned.cartesian, place)
    robot.motorState.state, robot.mciState.state, robot.rapidExecState.state = 1, 3, 2
    link.sendto(robot.SerializeToString(), ("127.0.0.1", port))
    try:
        data, _ = link.recvfrom(65535)
    except socket.timeout:
        continue
    for codec in (egm_pb2, other_pb2):
        sensor = codec.EgmSensor() if door == "egm" else codec.EgmSensorPathCorr()
        sensor.ParseFromString(data)
        if door == "egm":
            got = sensor.planned.cartesian.pos
            largest = max(largest, math.dist((got.x, got.y, got.z), place))
            in_order &= sensor.planned.cartesian.orient.u1 == 1.0
        else:
            largest = max(largest, abs(sensor.pathCorr.pos.y))
        in_order &= sensor.header.seqno == answered
        kinds.add(sensor.header.mtype)
    answered += 1
    time.sleep(max(0.0, cycle_ms * 1e-3 - (time.monotonic() - begun)))
print(json.dumps({"cycles": cycles, "answered": answered, "in_order": in_order, "kinds": sorted(kinds), "largest_mm": largest}))
