"""A link between two network namespaces that is slow and loses packets.

Two TUN devices, one moved into each namespace; what comes out of one goes into the other a fixed time later, or, with a
seeded generator's consent, not at all. TCP on both sides is the kernel's: it sees loss and sends again. The kernel's own
netem does the same where it is built in; this works wherever there is /dev/net/tun, and loses the same share everywhere.
"""

import collections
import fcntl
import os
import random
import select
import struct
import subprocess
import threading
import time

TUNSETIFF = 0x400454CA
IFF_TUN_WITHOUT_HEADER = 0x0001 | 0x1000
LONGEST_PACKET = 65536


def ip(*arguments):
    subprocess.run(["ip", *arguments], check=True, timeout=20)


class End:
    """A TUN device in a namespace."""

    def __init__(self, device, namespace, address):
        self.file = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(self.file, TUNSETIFF, struct.pack("16sH", device.encode(), IFF_TUN_WITHOUT_HEADER))
        # The device is made here and keeps its file when it is moved.
        ip("link", "set", device, "netns", namespace)
        ip("-n", namespace, "addr", "add", f"{address}/24", "dev", device)
        ip("-n", namespace, "link", "set", device, "up")


class Relay:
    """Carries packets between two ends until it is closed."""

    def __init__(self, ends, delay_s, loss, seed=1):
        self.ends = ends
        self.delay_s = delay_s
        self.loss = loss
        self.random = random.Random(seed)
        self.cut_until = 0.0
        self.carried = self.lost = 0
        self.closing = False
        self.thread = threading.Thread(target=self._carry, daemon=True)
        self.thread.start()

    def cut(self, seconds):
        """Lets nothing through for some time."""
        self.cut_until = time.monotonic() + seconds

    def close(self):
        self.closing = True
        self.thread.join(timeout=5)
        for end in self.ends:
            os.close(end.file)

    def _carry(self):
        under_way = collections.deque()  # (when due, to, packet), in the order of their times
        files = [end.file for end in self.ends]
        while not self.closing:
            now = time.monotonic()
            while under_way and under_way[0][0] <= now:
                _, to, packet = under_way.popleft()
                try:
                    os.write(to, packet)
                except OSError:  # the device's queue is full, as on any link
                    self.lost += 1
            patience = min(under_way[0][0] - now, 0.1) if under_way else 0.1
            for file in select.select(files, [], [], patience)[0]:
                packet = os.read(file, LONGEST_PACKET)
                due = time.monotonic() + self.delay_s
                if due - self.delay_s < self.cut_until or self.random.random() < self.loss:
                    self.lost += 1
                else:
                    self.carried += 1
                    under_way.append((due, files[1 - files.index(file)], packet))
