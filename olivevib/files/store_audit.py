"""Whether an HDF5 file holds nothing but plain arrays, before any of it is read.

An HDF5 file can point at other files (external links, raw storage, virtual datasets), load
plug-ins to unpack itself, or unpack to a thousand times its size; h5py has no switch against
that. Here the links are looked at without being followed.
"""

from __future__ import annotations

from typing import Any

from h5py import h5a, h5d, h5g, h5l, h5o, h5s, h5t, h5z

MAX_OBJECTS = 2000
MAX_BYTES = 2 << 30  # of one array, unpacked
MAX_TOTAL_BYTES = 8 << 30
MAX_RATIO = 1100  # gzip cannot pack tighter; what claims more was never written
RATIO_FROM_BYTES = 64 << 20
MAX_ATTRIBUTES = 1000
NOT_A_VARIABLE = "This is a netCDF dimension but not a netCDF variable."
_FILTERS = (h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE, h5z.FILTER_FLETCHER32)


class Foreign(Exception):
    """The file holds something that olivevib never writes."""


def audit(h5: Any) -> None:
    """Raise Foreign unless all is hard links to plain arrays, at most one group deep."""
    seen: set[Any] = set()
    total = _audit_group(h5.id, "", seen)
    for name, link in _links(h5.id):
        if link == h5o.TYPE_GROUP:
            total += _audit_group(h5o.open(h5.id, name), name.decode("utf-8", "replace"), seen)
    if total > MAX_TOTAL_BYTES:
        raise Foreign(f"It unpacks to {total >> 30} GiB.")


def text_attribute(item: Any, name: str) -> str:
    """A text attribute, or an empty text where there is none or it is no text."""
    if not h5a.exists(item.id, name.encode()):  # much faster than an error caught
        return ""
    value = item.attrs[name]
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else ""


def _links(group: Any) -> list[tuple[bytes, int]]:
    """Names and kinds (group or dataset) of what a group holds; only hard links are resolved."""
    names: list[bytes] = []
    count = group.get_num_objs()
    if count > MAX_OBJECTS:
        raise Foreign(f"It holds {count} objects.")
    group.links.iterate(names.append)
    out = []
    for name in names:
        if group.links.get_info(name).type != h5l.TYPE_HARD:
            raise Foreign(f"{_text(name)} is a link to somewhere else.")
        out.append((name, h5o.get_info(group, name).type))
    return out


def _audit_group(group: Any, path: str, seen: set[Any]) -> int:
    """Audit the arrays of a group; returns their unpacked size in bytes."""
    if not isinstance(group, h5g.GroupID):
        raise Foreign(f"{path} is no group.")
    total = 0
    for name, kind in _links(group):
        where = f"{path}/{_text(name)}"
        info = h5o.get_info(group, name)
        if (info.fileno, info.addr) in seen:
            raise Foreign(f"{where} stands in two places.")
        seen.add((info.fileno, info.addr))
        if len(seen) > MAX_OBJECTS:
            raise Foreign(f"It holds more than {MAX_OBJECTS} objects.")
        if info.num_attrs > MAX_ATTRIBUTES:
            raise Foreign(f"{where} has {info.num_attrs} attributes.")
        if kind == h5o.TYPE_DATASET:
            total += _audit_dataset(h5d.open(group, name), where)
        elif kind != h5o.TYPE_GROUP or path:
            raise Foreign(f"{where} is neither an array nor a group of arrays.")
    return total


def _audit_dataset(dataset: Any, where: str) -> int:
    """Audit how one array is stored; returns its unpacked size in bytes."""
    plan = dataset.get_create_plist()
    if plan.get_layout() not in (h5d.CONTIGUOUS, h5d.CHUNKED) or plan.get_external_count():
        raise Foreign(f"{where} keeps its values elsewhere.")
    for k in range(plan.get_nfilters()):
        if plan.get_filter(k)[0] not in _FILTERS:
            raise Foreign(f"{where} is packed in an unknown way.")
    space, kind = dataset.get_space(), dataset.get_type()
    if space.get_simple_extent_type() == h5s.NULL:
        raise Foreign(f"{where} holds nothing.")
    _audit_type(kind, where)
    size = int(space.get_simple_extent_npoints()) * int(kind.get_size())
    stored = int(dataset.get_storage_size())
    if size > MAX_BYTES:
        raise Foreign(f"{where} unpacks to {size >> 20} MiB.")
    if size > RATIO_FROM_BYTES and size > MAX_RATIO * stored:
        raise Foreign(f"{where} claims {size >> 20} MiB, but stores {stored} bytes.")
    return size


def _audit_type(kind: Any, where: str) -> None:
    plain = kind.get_class() in (h5t.INTEGER, h5t.FLOAT)
    text = kind.get_class() == h5t.STRING and kind.is_variable_str()
    if not (plain or text):
        raise Foreign(f"{where} holds values of an unknown kind.")


def _text(name: bytes) -> str:
    return name.decode("utf-8", "replace")
