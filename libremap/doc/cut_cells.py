#!/usr/bin/env python3
"""cut_cells.py MESH PNG -- a picture of what examples/cut_cells has made, cut open.

    build/examples/cut_cells cut_cells.txt
    python3 libremap/doc/cut_cells.py cut_cells.txt libremap/doc/cut_cells.png

Needs python3-numpy. Cells in front are taken away, the body stays. A depth buffer decides what is seen, a second one from the
lamp what lies in shadow; lines are drawn where neighbouring pixels belong to different polygons."""
import struct
import sys
import zlib

import numpy as np

WIDTH, HEIGHT, FINE = 1300, 860, 3  # pixels, and samples along each side of one
EYE, LOOK_AT, ZOOM = np.array([5.0, -6.8, 6.0]), np.array([-0.01, -0.03, -0.06]), 0.148
LAMP = np.array([-1.2, -2.4, 4.2])
PLAIN, CUT, BODY, SIDES = (0.93, 0.92, 0.88), (0.30, 0.62, 0.66), (0.93, 0.47, 0.24), (0.80, 0.84, 0.88)


def read(path):
    """Nodes [n, 3]; faces as (owner, neighbour, on_body, nodes)."""
    with open(path) as text:
        words = text.readline().replace(",", "").split()
        nodes, faces = int(words[1]), int(words[3])
        xyz = np.array([text.readline().split() for _ in range(nodes)], float)
        rows = [[int(w) for w in text.readline().split()] for _ in range(faces)]
    return xyz, [(r[0], r[1], r[2], r[4:]) for r in rows]


def centres(xyz, faces):
    """Mean of each cell's faces' means, and which cells have a face on the body."""
    cells = 1 + max(max(f[0], f[1]) for f in faces)
    total, count, cut = np.zeros((cells, 3)), np.zeros(cells), np.zeros(cells, bool)
    for owner, neighbour, on_body, loop in faces:
        mean = xyz[loop].mean(axis=0)
        for cell in (owner, neighbour):
            if cell >= 0:
                total[cell] += mean
                count[cell] += 1
                cut[cell] |= on_body == 1
    return total / count[:, None], cut


def is_taken_away(x):
    """What is above a plane, but for the far corner, and the near corner below it; all between layers of the grid."""
    x, y, z = x.T
    return (z > -0.05) & ~((x < -0.4) & (y > 0.7)) | (x > 0.4) & (y < -0.3)


def choose(xyz, faces):
    """What is to be drawn: loops with their colours."""
    middle, cut = centres(xyz, faces)
    gone = is_taken_away(middle)
    shown = []
    for owner, neighbour, on_body, loop in faces:
        stays = [c for c in (owner, neighbour) if c >= 0 and not gone[c]]
        if on_body:
            shown.append((loop, BODY))
        elif len(stays) == 1:
            inside = neighbour >= 0
            shown.append((loop, (CUT if cut[stays[0]] else PLAIN) if inside else (CUT if cut[stays[0]] else SIDES)))
    return shown


def view(eye, look_at):
    """Rows: right, up, towards the eye."""
    back = (eye - look_at) / np.linalg.norm(eye - look_at)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(back, right), back])


def ears(p):
    """Triangles of a polygon in the plane, corners p [n, 2]."""
    def area(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    left = list(range(len(p)))
    way = np.sign(sum(area(p[0], p[i], p[i + 1]) for i in range(1, len(p) - 1)))
    out = []
    while len(left) > 3:
        for i in range(len(left)):
            a, b, c = left[i - 1], left[i], left[(i + 1) % len(left)]
            if way * area(p[a], p[b], p[c]) <= 0:
                continue
            if not any(min(way * area(p[u], p[v], p[k]) for u, v in ((a, b), (b, c), (c, a))) >= 0
                       for k in left if k not in (a, b, c)):
                out.append((a, b, c))
                del left[i]
                break
        else:
            break
    return out + [(left[0], left[i], left[i + 1]) for i in range(1, len(left) - 1)]


def raster(points, shown, shape):
    """Depth (towards the eye, greatest seen) and polygon at each sample; points are in samples, depth last."""
    depth, who = np.full(shape, -np.inf), np.full(shape, -1, int)
    for number, (loop, _) in enumerate(shown):
        p = points[loop]
        for a, b, c in ears(p[:, :2]) if len(loop) > 3 else [(0, 1, 2)]:
            t = p[[a, b, c]]
            x0, y0 = np.maximum(np.floor(t[:, :2].min(axis=0)).astype(int), 0)
            x1, y1 = np.minimum(np.ceil(t[:, :2].max(axis=0)).astype(int) + 1, (shape[1], shape[0]))
            d = (t[1, 0] - t[0, 0]) * (t[2, 1] - t[0, 1]) - (t[1, 1] - t[0, 1]) * (t[2, 0] - t[0, 0])
            if x0 >= x1 or y0 >= y1 or abs(d) < 1e-9:
                continue
            y, x = np.mgrid[y0:y1, x0:x1] + 0.5
            u = ((x - t[0, 0]) * (t[2, 1] - t[0, 1]) - (y - t[0, 1]) * (t[2, 0] - t[0, 0])) / d
            v = ((t[1, 0] - t[0, 0]) * (y - t[0, 1]) - (t[1, 1] - t[0, 1]) * (x - t[0, 0])) / d
            z = t[0, 2] + u * (t[1, 2] - t[0, 2]) + v * (t[2, 2] - t[0, 2])
            box = depth[y0:y1, x0:x1]
            nearer = (u >= -1e-6) & (v >= -1e-6) & (u + v <= 1 + 1e-6) & (z > box)
            box[nearer] = z[nearer]
            who[y0:y1, x0:x1][nearer] = number
    return depth, who


def blur(a, radius):
    """Mean over a square, quickly."""
    for axis in (0, 1):
        pad = [(radius + 1, radius) if k == axis else (0, 0) for k in (0, 1)]
        total = np.cumsum(np.pad(a, pad, mode="edge"), axis=axis)
        n = a.shape[axis]
        hi, lo = np.take(total, range(2 * radius + 1, 2 * radius + 1 + n), axis), np.take(total, range(n), axis)
        a = (hi - lo) / (2 * radius + 1)
    return a


def normals(xyz, shown):
    out = np.zeros((len(shown), 3))
    for i, (loop, _) in enumerate(shown):
        p = xyz[loop]
        n = np.cross(p[1:-1] - p[0], p[2:] - p[0]).sum(axis=0)
        out[i] = n / max(np.linalg.norm(n), 1e-30)
    return out


def shadow(xyz, shown, world, normal):
    """The share of the lamp's light that reaches each point, soft at the edges."""
    axes, size = view(LAMP, np.zeros(3)), 1800
    scale = size / 6.4
    map_points = (xyz @ axes.T) * [scale, scale, 1] + [size / 2, size / 2, 0]
    depth, _ = raster(map_points, shown, (size, size))
    at = (world + 0.012 * normal) @ axes.T
    lit = np.zeros(len(world))
    offsets = [(i, j) for i in range(-4, 5, 2) for j in range(-4, 5, 2)]
    for i, j in offsets:
        x = np.clip((at[:, 0] * scale + size / 2 + i).astype(int), 0, size - 1)
        y = np.clip((at[:, 1] * scale + size / 2 + j).astype(int), 0, size - 1)
        lit += depth[y, x] <= at[:, 2] + 0.012
    return lit / len(offsets)


def shade(xyz, shown, axes, depth, who, to_world):
    """Colours of all samples."""
    seen = who >= 0
    normal = normals(xyz, shown)[who[seen]]
    world = to_world(seen)
    normal *= np.where((normal * (EYE - world)).sum(axis=1) < 0, -1, 1)[:, None]
    lamp = LAMP / np.linalg.norm(LAMP)
    direct = np.clip(normal @ lamp, 0, 1) * shadow(xyz, shown, world, normal)
    sky = 0.5 + 0.5 * normal[:, 2]
    front = np.clip(normal @ axes[2], 0, 1)
    light = 0.40 + 0.20 * sky + 0.12 * front + 0.40 * direct
    colour = np.array([c for _, c in shown])[who[seen]]
    image = np.ones(who.shape + (3,))
    image[seen] = np.clip(colour * light[:, None] * 1.04, 0, 1)
    near = np.where(seen, depth, depth[seen].min() - 1.5)
    for radius, weight in ((8, 0.35), (24, 0.35), (60, 0.30)):  # corners get less light
        hidden = np.clip(blur(near, radius * FINE // 3) - near, 0, 0.35) * np.where(seen, 1, 0.25)
        image *= 1 - weight * hidden[:, :, None]
    return image


def draw_lines(image, depth, who):
    """Dark where the polygon changes, darker where the depth jumps."""
    line = np.zeros(who.shape)
    for axis in (0, 1):
        for step in (1, -1):
            other, far = np.roll(who, step, axis), np.roll(depth, step, axis)
            jump = np.isfinite(depth) & (~np.isfinite(far) | (depth - np.where(np.isfinite(far), far, 0) > 0.08))
            line = np.maximum(line, np.where(jump, 0.85, np.where((other != who) & (who >= 0), 0.42, 0)))
    return image * (1 - line[:, :, None] * 0.8)


def write_png(path, image):
    rows = (np.clip(image, 0, 1) ** (1 / 1.12) * 255 + 0.5).astype(np.uint8)
    raw = b"".join(b"\0" + row.tobytes() for row in rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", rows.shape[1], rows.shape[0], 8, 2, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def main():
    xyz, faces = read(sys.argv[1])
    shown = choose(xyz, faces)
    axes = view(EYE, LOOK_AT)
    distance = np.linalg.norm(EYE - LOOK_AT)
    shape = (HEIGHT * FINE, WIDTH * FINE)
    scale = ZOOM * shape[1]

    local = (xyz - LOOK_AT) @ axes.T
    stretch = distance / (distance - local[:, 2])
    flat = local[:, :2] * (scale * stretch)[:, None]
    points = np.column_stack([shape[1] / 2 + flat[:, 0], shape[0] / 2 - flat[:, 1], stretch])
    stretched, who = raster(points, shown, shape)
    depth = np.where(np.isfinite(stretched), distance - distance / np.where(np.isfinite(stretched), stretched, 1), -np.inf)

    def to_world(seen):
        y, x = np.nonzero(seen)
        s = stretched[seen]
        flat = np.column_stack([(x + 0.5 - shape[1] / 2) / scale / s, (shape[0] / 2 - y - 0.5) / scale / s, depth[seen]])
        return flat @ axes + LOOK_AT

    image = draw_lines(shade(xyz, shown, axes, depth, who, to_world), depth, who)
    write_png(sys.argv[2], image.reshape(HEIGHT, FINE, WIDTH, FINE, 3).mean(axis=(1, 3)))


if __name__ == "__main__":
    main()
