"""Decodes what a recording shows other programs with Foxglove's own message definitions.

    pip install mcap mcap-protobuf-support foxglove-schemas-protobuf
    python read_display.py FILE.mcap

Fails where a message does not decode, holds what Foxglove does not define, or where an embedded schema differs from the
published one. Prints how far the particles moved.
"""

import struct
import sys

from foxglove_schemas_protobuf import Log_pb2, PackedElementField_pb2, PointCloud_pb2, Pose_pb2, Quaternion_pb2, Vector3_pb2
from google.protobuf import descriptor_pb2
from mcap.reader import make_reader

PUBLISHED = [
    Log_pb2.Log,
    PackedElementField_pb2.PackedElementField,
    PointCloud_pb2.PointCloud,
    Pose_pb2.Pose,
    Quaternion_pb2.Quaternion,
    Vector3_pb2.Vector3,
]


def shape(message: descriptor_pb2.DescriptorProto) -> tuple:
    """Names, numbers and types of a message and of its enumerations."""
    fields = sorted((f.name, f.number, f.type, f.label, f.type_name) for f in message.field)
    return fields, [(e.name, sorted((v.name, v.number) for v in e.value)) for e in message.enum_type]


def check_schema(data: bytes) -> None:
    embedded = descriptor_pb2.FileDescriptorSet.FromString(data)
    messages = {f"{file.package}.{message.name}": message for file in embedded.file for message in file.message_type}
    for published in PUBLISHED:
        wanted = descriptor_pb2.DescriptorProto()
        published.DESCRIPTOR.CopyToProto(wanted)
        name = published.DESCRIPTOR.full_name
        if shape(messages[name]) != shape(wanted):
            raise SystemExit(f"{name} differs from the published definition")


def places(cloud: PointCloud_pb2.PointCloud) -> list[tuple[float, ...]]:
    offsets = {field.name: field.offset for field in cloud.fields}
    rows = range(0, len(cloud.data), cloud.point_stride)
    return [tuple(struct.unpack_from("<f", cloud.data, row + offsets[axis])[0] for axis in "xyz") for row in rows]


def main(path: str) -> int:
    clouds, lines, scalars = [], [], set()
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if schema.name == "foxglove.PointCloud":
                check_schema(schema.data)
                cloud = PointCloud_pb2.PointCloud.FromString(message.data)
                # What Foxglove does not define would be lost on the way.
                assert len(cloud.SerializeToString()) == len(message.data), "unknown fields"
                assert len(cloud.data) % cloud.point_stride == 0
                clouds.append((message.log_time, cloud))
            elif schema.name == "foxglove.Log":
                lines.append(Log_pb2.Log.FromString(message.data))
            elif channel.topic.startswith("display/scalars/"):
                scalars.add(channel.topic)
    if not clouds or not lines or not scalars:
        print(f"{path}: {len(clouds)} clouds, {len(lines)} log lines, {len(scalars)} scalars", file=sys.stderr)
        return 1
    assert all(before[0] < after[0] for before, after in zip(clouds, clouds[1:])), "time stands still"
    # Particles may be poured in later.
    filled = [(time_ns, cloud) for time_ns, cloud in clouds if cloud.data]
    (first_ns, first), (last_ns, last) = filled[0], filled[-1]
    moved = max(
        sum((b - a) ** 2 for a, b in zip(p, q)) ** 0.5 for p, q in zip(places(first), places(last))
    )
    print(f"{len(clouds)} clouds from {first_ns} to {last_ns} ns; particles moved by up to {moved:.3f} mm")
    print(f"fields: {', '.join(field.name for field in last.fields)}")
    print(f"{len(scalars)} scalars, {len(lines)} log lines; the last: {lines[-1].message}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
