#!/usr/bin/env python3
"""A second reader of the protocol, written from host/guide/protocol.md alone: no line of it is shared with the Rust code.

Usage: reader.py PORT. Says hello, asks for the state, runs a circle and records it, stops another one, reads limits and
log, and looks at everything that comes back. Needs nothing but Python.
"""
import math
import os
import struct
import sys
import time
import tty
import zlib

SESSION = 4660


def varint(n):
    out = bytearray()
    while n > 0x7F:
        out.append(n & 0x7F | 0x80)
        n >>= 7
    out.append(n)
    return bytes(out)


def zigzag(n):
    return varint(n << 1 if n >= 0 else (-n << 1) - 1)


def f32(x):
    return struct.pack("<f", x)


def cobs(data):
    out, run = bytearray(), bytearray()
    for byte in data:
        if byte == 0:
            out.append(len(run) + 1)
            out += run
            run.clear()
        else:
            run.append(byte)
    out.append(len(run) + 1)
    return bytes(out + run)


def uncobs(data):
    out, at = bytearray(), 0
    while at < len(data):
        code = data[at]
        out += data[at + 1:at + code]
        at += code
        if at < len(data) and code != 0xFF:
            out.append(0)
    return bytes(out)


class Reader:
    """Takes a payload apart."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def u(self):
        value = shift = 0
        while True:
            byte = self.byte()
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
            shift += 7

    def i(self):
        n = self.u()
        return -(n + 1 >> 1) if n & 1 else n >> 1

    def f32(self):
        self.at += 4
        return struct.unpack("<f", self.data[self.at - 4:self.at])[0]

    def place(self):
        return [self.i() for _ in range(3)]

    def option(self, read):
        return read() if self.byte() else None

    def text(self):
        length = self.u()
        self.at += length
        return self.data[self.at - length:self.at].decode()

    def end(self):
        assert self.at == len(self.data), f"{len(self.data) - self.at} bytes left over"


def slot(r):
    kind = r.u()
    if kind == 2:
        return kind, r.u()
    if kind == 3:
        return kind, r.u(), r.u(), r.option(r.u)
    return (kind,)


def status(r):
    return {
        "motion": r.u(), "fault": r.option(r.u), "stop_input": r.byte(), "bypass": r.byte(), "active": r.option(r.u),
        "slots": [slot(r), slot(r)], "probation": r.u(), "queued": r.u(), "tick": r.u(), "stack": r.u(),
        "idle": r.option(r.u), "raw": r.place(), "corrected": r.place(), "position": r.u(), "override": r.u(),
        "reset": r.u(), "clock": r.u(), "worst": r.option(r.u), "stack_left": r.u(), "counters": [r.u() for _ in range(17)],
    }


class Controller:
    def __init__(self, path):
        self.port = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.port)
        self.seq, self.bytes, self.batches = 0, bytearray(), []

    def frames(self):
        try:
            self.bytes += os.read(self.port, 4096)
        except BlockingIOError:
            time.sleep(0.001)
        while 0 in self.bytes:
            end = self.bytes.index(0)
            frame = bytes(self.bytes[:end])
            del self.bytes[:end + 1]
            content = uncobs(frame) if frame else b""
            if len(content) > 4 and zlib.crc32(content[:-4]) == int.from_bytes(content[-4:], "little"):
                yield Reader(content[:-4])

    def take(self, reader):
        """A batch of set-points, put away, or the reply to the last request."""
        if reader.u() == 1:
            tick, every, last = reader.u(), reader.u(), reader.byte()
            points = [(reader.place(), reader.place()) for _ in range(reader.u())]
            reader.end()
            self.batches.append((tick, every, last, points))
            return None
        mine = reader.u() == SESSION and reader.u() == self.seq
        return reader if mine else None

    def listen(self):
        for reader in self.frames():
            self.take(reader)

    def ask(self, number, fields=b""):
        self.seq += 1
        payload = varint(SESSION) + varint(self.seq) + varint(number) + fields
        frame = b"\0" + cobs(payload + zlib.crc32(payload).to_bytes(4, "little")) + b"\0"
        # The same request again until it is answered: it happens once.
        for _ in range(100):
            os.write(self.port, frame)
            until = time.monotonic() + 0.3
            while time.monotonic() < until:
                for reader in self.frames():
                    reply = self.take(reader)
                    if reply is not None:
                        return reply
        sys.exit("no answer")

    def done(self, number, fields=b""):
        reply = self.ask(number, fields)
        assert reply.u() == 0, f"request {number} refused"
        reply.end()

    def status(self):
        reply = self.ask(1)
        assert reply.u() == 2
        state = status(reply)
        reply.end()
        return state

    def at_rest(self):
        while True:
            state = self.status()
            if state["motion"] in (0, 3):
                return state


def circle(radius_nm, feed, laps):
    # Centre, radius, feed, plane XY, counter-clockwise, laps, start.
    return zigzag(0) * 3 + zigzag(2 * radius_nm) + f32(feed) + varint(0) + varint(0) + varint(laps) + varint(0)


def main():
    c = Controller(sys.argv[1])
    hello = c.ask(0)
    assert hello.u() == 1
    board, build, protocol, _, _, longest, tick_hz, signed = (
        hello.text(), hello.text(), hello.u(), hello.u(), hello.u(), hello.u(), hello.u(), hello.byte())
    machine = bytes(hello.byte() for _ in range(12))
    hello.end()
    assert protocol == 5 and longest > 500 and signed == 0 and board and build and len(machine) == 12
    before = c.status()
    assert before["motion"] == 0 and before["position"] in (1, 2)

    # A circle of 50 mm, every twentieth set-point on the link.
    c.done(12, varint(20) + b"\x01")
    c.done(10, circle(50_000_000, 0.4, 1))
    while not (c.batches and c.batches[-1][2]):
        c.listen()
        c.status()
    due, points = c.batches[0][0], []
    for tick, every, _, some in c.batches:
        assert (tick, every) == (due, 20), "a batch is missing"
        due += 20 * len(some)
        points += some
    on = sum(abs(math.hypot(p[0], p[1]) - 5e7) < 3 for p, _ in points)
    assert on * 20 > tick_hz * 2 * math.pi * 0.05 / 0.4, f"{on} points on the circle"
    assert all(raw == corrected for raw, corrected in points), "corrected without a table"
    c.done(12, varint(0) + b"\x01")

    # A stop, a refusal, a stream of a few set-points.
    c.done(10, circle(50_000_000, 0.2, 1000))
    assert c.ask(10, circle(50_000_000, 0.2, 1)).u() == 5, "a second run is refused"
    c.done(11)
    at = c.at_rest()["raw"]
    # It begins once 40 wait, or at the end of a shorter one: however late this reader is, nothing is missing on the way.
    c.done(19, f32(0.5) + varint(40))
    steps = b"".join(zigzag(n) + zigzag(0) * 2 for n in (1000, 1000, 0, -1000, -1000))
    c.done(20, varint(len(steps)) + steps)
    c.done(18)
    end = c.at_rest()
    assert end["motion"] == 0 and end["raw"] == [at[0] + 6000, at[1], at[2]], f"{at} to {end['raw']}"

    # Declared elsewhere, limits, log.
    c.done(22, zigzag(1_000_000) + zigzag(-2_000_000) + zigzag(0))
    while c.status()["raw"] != [1_000_000, -2_000_000, 0]:
        pass
    limits = c.ask(26)
    assert limits.u() == 6
    numbers = [limits.f32() for _ in range(9)]
    soft = [(limits.i(), limits.i()) for _ in range(3)]
    limits.byte()
    assert limits.u() == tick_hz
    steps = [(limits.u(), limits.u()) for _ in range(3)]
    assert all(nm > 0 and of > 0 for nm, of in steps), steps
    limits.byte()
    limits.end()
    assert all(n > 0 for n in numbers) and all(least < most for least, most in soft)
    log = c.ask(29, varint(0))
    assert log.u() == 7 and log.u() == 0 and log.u() >= 3, "the log begins with the start"
    print(f"ok: {board} {build}, {len(points)} set-points")


main()
