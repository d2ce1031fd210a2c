"""RSIPI's echo server as the robot: checks IPOC, the sender's type and lateness, on the files that `giotto bridge rsi --program` wrote.

Arguments: the ETHERNET file, cycles. Prints one JSON document. The server has no path of its own; it is given a circle here.
"""
import json
import math
import sys
import time

from RSIPI.rsi_echo_server import EchoServer

config, cycles = sys.argv[1], int(sys.argv[2])


class Robot(EchoServer):
    def generate_message(self):
        t = (self.ipoc_value - self.first_ipoc) * 1e-3
        angle = t * t if t < 1.0 else 2.0 * t - 1.0
        place = {"X": 100.0 * math.cos(angle), "Y": 100.0 * math.sin(angle), "Z": 0.0}
        self.state["RSol"].update(place)
        # Corrections are measured from here.
        self.base_pose["RIst"] = dict(self.state["RIst"], **place)
        return super().generate_message()


server = Robot(config, delay_ms=4, mode="absolute")
for state in ("RIst", "RSol"):
    server.state[state].update(X=100.0, Y=0.0, Z=0.0)
answered, rejected, largest = 0, 0, 0.0
for cycle in range(cycles):
    begun = time.monotonic()
    server.send_once()
    outcome = server.receive_and_process()
    rejected += outcome is False
    if outcome is True:
        answered += 1
        korr = server.last_corrections.get("RKorr", {})
        largest = max(largest, math.sqrt(sum(korr.get(axis, 0.0) ** 2 for axis in "XYZ")))
    time.sleep(max(0.0, 0.004 - (time.monotonic() - begun)))
server.udp_socket.close()
print(json.dumps({"cycles": cycles, "answered": answered, "rejected": rejected, "largest_mm": largest}))
