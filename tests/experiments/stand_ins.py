"""Programs of eye trackers, as far as their protocols are documented, for tests without the devices."""

from __future__ import annotations

import re
import socket
import threading
import time
from typing import Any

__all__ = ["Gazepoint", "PupilCapture"]


class Gazepoint(threading.Thread):
    """Gazepoint Control: elements of XML, a line each, over TCP (Open Gaze API 2.0).

    Each SET and GET is answered by an ACK of the same ID; while ENABLE_SEND_DATA is 1 records (REC) follow at 60 Hz.
    """

    def __init__(self, host: str, place: tuple[float, float]):
        super().__init__(daemon=True)
        self._server = socket.create_server((host, 0))
        self._server.settimeout(None)  # PsychoPy, once imported, sets a timeout for all new ones
        self.port = self._server.getsockname()[1]
        self.place, self.asked = place, list[str]()
        self.start()

    def run(self) -> None:
        while True:
            connection, _ = self._server.accept()
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with connection:
            self._answer(connection)

    def _answer(self, connection: socket.socket) -> None:
        connection.settimeout(1 / 60)
        text, sending, began, number = "", False, time.monotonic(), 0
        while True:
            try:
                if not (got := connection.recv(4096)):
                    return
                text += got.decode()
            except TimeoutError:
                pass
            except OSError:
                return
            *lines, text = text.split("\r\n")
            for line in lines:
                self.asked.append(line)
                found = re.match(r'<(?:GET|SET) ID="(\w+)"\s*(.*?)\s*/>', line)
                assert found, line
                name, rest = found.groups()
                if name == "TIME_TICK_FREQUENCY":
                    rest = 'FREQ="10000000"'
                if name == "ENABLE_SEND_DATA":
                    sending = '"1"' in rest
                connection.sendall(f'<ACK ID="{name}" {rest} />\r\n'.encode())
            if sending:
                number += 1
                try:
                    connection.sendall(self._record(number, time.monotonic() - began))
                except OSError:
                    return

    def _record(self, number: int, seconds: float) -> bytes:
        x, y = self.place
        where = " ".join(f'{eye}POGX="{x:.5f}" {eye}POGY="{y:.5f}" {eye}POGV="1"' for eye in "FLRB")
        eyes = " ".join(
            f'{eye}PCX="0.4" {eye}PCY="0.5" {eye}PD="20.5" {eye}PS="1.0" {eye}PV="1" {eye}PUPILD="0.0035" '
            f'{eye}PUPILV="1"'
            for eye in "LR"
        )
        when = f'CNT="{number}" TIME="{seconds:.5f}" TIME_TICK="{round(seconds * 1e7)}"'
        return f'<REC {when} FPOGS="0.0" FPOGD="{seconds:.5f}" FPOGID="1" {where} {eyes} />\r\n'.encode()


class PupilCapture(threading.Thread):
    """Pupil Capture's Network API: Pupil Remote (requests and replies) and the backbone that publishes in msgpack."""

    def __init__(self, host: str, place: tuple[float, float]):
        import zmq

        super().__init__(daemon=True)
        context = zmq.Context.instance()
        self._replies, self._publisher = context.socket(zmq.REP), context.socket(zmq.PUB)
        self.port = self._replies.bind_to_random_port(f"tcp://{host}")
        self._published = self._publisher.bind_to_random_port(f"tcp://{host}")
        self._more = zmq.SNDMORE
        self.place, self.asked = place, list[str]()
        self.start()

    def run(self) -> None:
        while True:
            if self._replies.poll(8):
                word = self._replies.recv_string()
                self.asked.append(word)
                port, now = str(self._published), repr(time.monotonic())
                self._replies.send_string({"SUB_PORT": port, "PUB_PORT": port, "t": now, "v": "3.5.1"}.get(word, "OK"))
                if word == "C":
                    self._publish("notify.calibration.successful", {})
            now, datum = time.monotonic(), {"confidence": 0.9, "norm_pos": self.place}
            eye = {
                "sphere": {"center": [0.0, 0.0, 0.0]},
                "phi": 0.0,
                "theta": 0.0,
                "diameter": 40.0,
                "diameter_3d": 3.5,
            }
            eyes = [{**eye, **datum, "id": number, "timestamp": now} for number in (0, 1)]
            self._publish("gaze.3d.01.", {"timestamp": now, "base_data": eyes})
            gaze = {**datum, "on_surf": True, "base_data": ["gaze.3d.01.", now]}
            self._publish("surfaces.psychopy_iohub_surface", {"gaze_on_surfaces": [gaze]})

    def _publish(self, topic: str, content: dict[str, Any]) -> None:
        import msgpack

        self._publisher.send_string(topic, self._more)
        self._publisher.send(msgpack.dumps(content))
