"""Your own robot: a point in a corridor, in lockstep, with its own implementation of the session protocol.

    python examples/robot.py tcp/127.0.0.1:7447 &
    maze-machine run right_hand --connect tcp/127.0.0.1:7447

docs/reference/link.md says what each field means. It needs eclipse-zenoh and nothing else.
"""

import array
import hashlib
import json
import math
import queue
import secrets
import struct
import sys
import zlib

import zenoh

NAME, PERIOD, CDR = "pico", 0.1, b"\x00\x01\x00\x00"
BEAMS, FIRST, STEP, NEAREST, FARTHEST = 1000, -2.0, 4 / 999, 0.01, 10.0
COMMAND, OBSERVATION = struct.Struct("<BBxxIQQq8s"), struct.Struct("<BBxxIIIQQQq")
lease = {"epoch": 0, "secret": "", "request": None, "sequence": 0}
place = [0.0, 0.0, 0.0]  # x, y, heading
shown: list[tuple[str, bytes, bytes]] = []


def ray(angle: float) -> float:
    """What a beam reads: walls at y = 0.5 and y = -0.5 for x from -1 to 4, a wall at x = -1, and nothing beyond."""
    x, y, heading = place
    cosine, sine = math.cos(heading + angle), math.sin(heading + angle)
    side = (math.copysign(0.5, sine) - y) / sine if abs(sine) > 1e-9 else math.inf
    back = (-1 - x) / cosine if cosine < -1e-9 else math.inf
    hit = min(side if x + side * cosine < 4 else math.inf, back)
    return hit if hit < FARTHEST else math.inf


def show(twist: tuple[float, float, float]) -> None:
    """Publish the sensor data; each message has the same tag, with the CRC-32 of both."""
    nanoseconds = round(lease["sequence"] * PERIOD * 1e9)
    time = divmod(nanoseconds, 10**9)
    pose = place[0], place[1], 0.0, 0.0, 0.0, math.sin(place[2] / 2), math.cos(place[2] / 2)
    velocity = twist[0], twist[1], 0.0, 0.0, 0.0, twist[2]
    odometry = struct.pack("<4siII5s3xI10s6x7d288x6d288x", CDR, *time, 5, b"odom", 10, b"base_link", *pose, *velocity)
    fan = FIRST, FIRST + (BEAMS - 1) * STEP, STEP, 0.0, PERIOD, NEAREST, FARTHEST, BEAMS
    ranges = array.array("f", (ray(FIRST + k * STEP) for k in range(BEAMS)))
    scan = struct.pack("<4siII6s2x7fI", CDR, *time, 6, b"laser", *fan) + ranges.tobytes() + bytes(4)
    blank = OBSERVATION.pack(2, 0, 0, 0, 0, lease["epoch"], 0, lease["sequence"], nanoseconds)
    shown[:] = []
    for key, payload in ((f"{NAME}/odom", odometry), (f"{NAME}/scan", scan)):
        sealed = blank[:4] + struct.pack("<I", zlib.crc32(payload, zlib.crc32(blank))) + blank[8:]
        shown.append((key, payload, sealed))


def answer(text: bytes) -> dict:
    """The answer to a question; a known request is a repeated question."""
    question = json.loads(text)
    known = bool(lease["secret"]) and question.get("secret") == lease["secret"]
    if question["kind"] == "open":
        if question["request"] != lease["request"]:
            lease.update(epoch=secrets.randbits(62) + 1, secret=secrets.token_hex(16), request=question["request"])
            lease["sequence"], place[:] = 0, [0.0, 0.0, 0.0]
            show((0.0, 0.0, 0.0))
        granted = {"kind": "granted", "robot": NAME, "mode": "lockstep", "period": PERIOD}
        return granted | {"epoch": lease["epoch"], "secret": lease["secret"]}
    if question["kind"] == "close" and known:
        lease.update(epoch=0, secret="", request=None)
    return {"kind": "state", "held": known, "reason": "", "sequence": lease["sequence"], "report": None}


def obey(payload: bytes, attachment: bytes) -> None:
    """Execute a command once, and answer it; a repeated one, or a request to repeat it, is answered as before."""
    version, flags, checksum, epoch, sequence, _, signature = COMMAND.unpack(attachment)
    signed = attachment[:4] + attachment[8:32] + payload
    whole = checksum == zlib.crc32(payload, zlib.crc32(attachment[:4] + bytes(4) + attachment[8:]))
    genuine = signature == hashlib.blake2s(signed, digest_size=8, key=lease["secret"].encode()).digest()
    if version != 2 or not whole or not genuine or epoch != lease["epoch"]:
        return
    if not flags & 2 and sequence == lease["sequence"]:
        _, forward, left, _, _, _, turn = struct.unpack("<4s6d", payload)
        cosine, sine = math.cos(place[2]), math.sin(place[2])
        place[0] += PERIOD * (cosine * forward - sine * left)
        place[1] += PERIOD * (sine * forward + cosine * left)
        place[2] += PERIOD * turn
        lease["sequence"] += 1
        show((forward, left, turn))


def main(endpoint: str) -> None:
    """Listen, and process messages in order."""
    config, inbox = zenoh.Config(), queue.SimpleQueue()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("listen/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        session.declare_queryable(f"{NAME}/session", inbox.put)
        session.declare_subscriber(f"{NAME}/cmd_vel", inbox.put)
        print(f"{NAME} listens at {endpoint}", flush=True)
        while True:
            item = inbox.get()
            if isinstance(item, zenoh.Query):
                text, _, _ = item.payload.to_bytes().rpartition(b"\n")
                # Programs ignore unknown fields, such as `maker`.
                reply = json.dumps({"protocol": 2, "maker": "me"} | answer(text)).encode()
                item.reply(item.key_expr, b"%s\n%08x" % (reply, zlib.crc32(reply)))
                item.drop()
            else:
                obey(item.payload.to_bytes(), item.attachment.to_bytes() if item.attachment else bytes(COMMAND.size))
            for key, payload, attachment in shown:
                session.put(key, payload, attachment=attachment)


if __name__ == "__main__":
    main(sys.argv[1])
