"""Poses and frames have the fields that Foxglove publishes for its own schemas, and no other."""

from collections.abc import Iterator

import pytest

from undertow.exports.mcap_series import SCHEMAS
from undertow.physics.reading import Plain

_TIME = {"timestamp": "object", "timestamp.sec": "integer", "timestamp.nsec": "integer"}
_PLACE = {"": "object", **dict.fromkeys((".x", ".y", ".z"), "number")}
_TURN = {**_PLACE, ".w": "number"}


def _pose(at: str) -> dict[str, str]:
    parts = {"position": _PLACE, "orientation": _TURN}
    return {at: "object"} | {f"{at}.{part}{end}": kind for part, ends in parts.items() for end, kind in ends.items()}


PUBLISHED = {
    "foxglove.PoseInFrame": {**_TIME, "frame_id": "string", **_pose("pose")},
    "foxglove.PosesInFrame": {**_TIME, "frame_id": "string", "poses": "array", **_pose("poses[]")},
    "foxglove.FrameTransform": {
        **_TIME,
        "parent_frame_id": "string",
        "child_frame_id": "string",
        "transform": "object",
        **{f"transform.translation{end}": kind for end, kind in _PLACE.items()},
        **{f"transform.rotation{end}": kind for end, kind in _TURN.items()},
    },
}
"""Fields and their types: https://github.com/foxglove/schemas, schemas/jsonschema, of 2022 and later, but for a time
within `Transform` that came later and need not be there."""


def fields(schema: Plain, at: str = "") -> Iterator[tuple[str, str]]:
    if at:
        yield at, schema.get("type", "")
    for name, part in schema.get("properties", {}).items():
        yield from fields(part, f"{at}.{name}".lstrip("."))
    if "items" in schema:
        yield from fields(schema["items"], f"{at}[]")


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_schema_of_foxglove_has_the_published_fields(name: str):
    assert SCHEMAS[name].get("title") == name
    assert dict(fields(SCHEMAS[name])) == PUBLISHED[name]
