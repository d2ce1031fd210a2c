"""Asks LinuxCNC for its limits, or has it run a program: LinuxCNC's own interface is Python.

Arguments: `limits`, or `run FILE SECONDS`. One JSON document on stdout. `complaint.py` goes before it.
"""
import json
import os
import select
import sys
import time

command, stat = linuxcnc.command(), linuxcnc.stat()


def ready():
    stat.poll()
    if stat.task_state != linuxcnc.STATE_ON:
        raise RuntimeError("the machine is off: take back the emergency stop and switch it on")
    if not all(stat.homed[: stat.joints]):
        raise RuntimeError("the machine is not homed")
    if stat.interp_state != linuxcnc.INTERP_IDLE:
        raise RuntimeError("a program runs")


def limits():
    ready()
    mm = 1.0 / stat.linear_units
    axes = [stat.axis[k] for k in (0, 1)]
    room = [min(axis["max_position_limit"], -axis["min_position_limit"]) for axis in axes]
    return {
        "room_mm": min(room) * mm,
        "feed_mm_s": stat.max_velocity * mm,
        "acceleration_mm_s2": stat.max_acceleration * mm,
    }


def waited_for():
    """Whoever asked holds our standard input open for as long as it waits."""
    readable, _, _ = select.select([sys.stdin], [], [], 0)
    return not readable or bool(os.read(sys.stdin.fileno(), 1))


def run(file, seconds):
    ready()
    complaint()
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete(10)
    command.program_open(file)
    command.wait_complete(10)
    done = False
    try:
        command.auto(linuxcnc.AUTO_RUN, 0)
        time.sleep(0.3)
        until = time.time() + float(seconds)
        while time.time() < until:
            stat.poll()
            said = complaint()
            if said:
                raise RuntimeError(said)
            if stat.task_state != linuxcnc.STATE_ON:
                raise RuntimeError("the machine was switched off")
            if stat.interp_state == linuxcnc.INTERP_IDLE:
                done = True
                return {"done": True}
            if not waited_for():
                raise RuntimeError("nobody waits for the program any more")
            time.sleep(0.02)
        raise RuntimeError("the program did not end within %s s" % seconds)
    finally:
        # Ctrl-C and whatever else comes: no machine goes on by itself.
        if not done:
            command.abort()


try:
    print(json.dumps(limits() if sys.argv[1] == "limits" else run(sys.argv[2], sys.argv[3])))
except BaseException as error:  # said to whoever asked
    print(json.dumps({"error": str(error) or type(error).__name__}))
