"""LinuxCNC's "display" in the scenario: does what it is told over a socket, one JSON document a line, and ends with it.

LinuxCNC's own interface is Python. Nothing is judged here. giotto_link's `complaint.py` goes before it.
"""
import json
import os
import signal
import socket
import subprocess
import time

command, stat = linuxcnc.command(), linuxcnc.stat()


def hal(*words):
    done = subprocess.run(["halcmd", *words], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(" ".join(words) + ": " + done.stderr.strip())
    return done.stdout.strip()


def up():
    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.wait_complete(10)
    command.state(linuxcnc.STATE_ON)
    command.wait_complete(10)
    command.home(-1)
    until = time.time() + 10
    while time.time() < until:
        stat.poll()
        if all(stat.homed[: stat.joints]):
            return {"homed": True}
        time.sleep(0.02)
    raise RuntimeError("not homed: " + str(complaint()))


def filled():
    """Lets the motion go on once all blocks up to the next stop are with the planner: a computer that is busy elsewhere
    must not make the machine wait on its way."""
    last, since, until = -1, time.time(), time.time() + 20
    while time.time() < until:
        stat.poll()
        if stat.queue != last:
            last, since = stat.queue, time.time()
        done = stat.interp_state in (linuxcnc.INTERP_PAUSED, linuxcnc.INTERP_IDLE)
        waiting = stat.interp_state == linuxcnc.INTERP_WAITING
        if time.time() - since > (0.5 if last > 0 or done or waiting else 2.0):
            break
        time.sleep(0.02)
    hal("setp", "motion.feed-hold", "0")


def program(order):
    """Runs a program; at each M0 the machine rests for a while, and goes on."""
    complaint()
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete(10)
    command.program_open(order["file"])
    command.wait_complete(10)
    out = open(order["samples"], "w")
    hal("setp", "sampler.0.enable", "1")
    sampler = subprocess.Popen(["halsampler", "-t"], stdout=out)
    stops = 0
    time.sleep(0.1)
    hal("setp", "motion.feed-hold", "1")
    command.auto(linuxcnc.AUTO_RUN, 0)
    time.sleep(0.2)
    filled()
    until, said = time.time() + order["within_s"], None
    while time.time() < until:
        stat.poll()
        said = said or complaint()
        if said or stat.interp_state == linuxcnc.INTERP_IDLE:
            break
        if stat.interp_state == linuxcnc.INTERP_PAUSED:
            time.sleep(0.4)
            stops += 1
            hal("setp", "motion.feed-hold", "1")
            command.auto(linuxcnc.AUTO_RESUME)
            time.sleep(0.1)
            filled()
        time.sleep(0.01)
    else:
        said = "the program did not end within %s s" % order["within_s"]
    command.wait_complete(10)
    time.sleep(0.4)
    hal("setp", "sampler.0.enable", "0")
    time.sleep(0.3)
    sampler.send_signal(signal.SIGINT)
    sampler.wait()
    out.close()
    stat.poll()
    if said:
        command.abort()
        raise RuntimeError(said)
    return {"stops": stops}


def obey(order):
    what = order["do"]
    if what == "up":
        return up()
    if what == "program":
        return program(order)
    if what == "set":
        hal("setp", order["name"], str(order["value"]))
        return {}
    if what == "get":
        return {"value": hal("getp", order["name"])}
    raise RuntimeError("unknown order " + what)


host, port = os.environ["GIOTTO_DRIVER"].split(":")
link = socket.create_connection((host, int(port)))
lines = link.makefile("rw")
for line in lines:
    try:
        answer = {"ok": obey(json.loads(line))}
    except Exception as error:  # said to whoever judges
        answer = {"error": str(error)}
    lines.write(json.dumps(answer) + "\n")
    lines.flush()
