"""Shows a run that is recorded, read back with the library mcap, and opened in Rerun where it is installed.

$ python record.py
> /scan
> the first scan has 1000 beams
"""

import shutil
import subprocess
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from rosbags.typesys import Stores, get_typestore

MACHINE = "../01_smallest/smallest.maze-machine"
RUN = f"maze-machine run {MACHINE} --maze ../straight.maze --no-picture --dated --record run.mcap"

subprocess.run(RUN.split(), check=True)
types = get_typestore(Stores.ROS2_HUMBLE)
messages: Counter[str] = Counter()
scan = None
with Path("run.mcap").open("rb") as file:
    for schema, channel, message in make_reader(file).iter_messages():
        messages[channel.topic] += 1
        if scan is None and schema and schema.name == "sensor_msgs/msg/LaserScan":
            scan = types.deserialize_cdr(message.data, schema.name)

for topic, count in sorted(messages.items()):
    print(f"{count:6} {topic}")
print(f"the first scan has {len(scan.ranges)} beams")

if shutil.which("rerun"):  # pip install rerun-sdk
    subprocess.run(["rerun", "run.mcap", "--save", "run.rrd"], check=True)
