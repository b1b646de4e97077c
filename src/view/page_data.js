// The trajectory in the page. It reads the output of view_data.cpp, in the same order.

const STATE = { present: 1, asleep: 2, impulse: 4, held: 8, statistical: 16, frozen: 32, passed: 64, failed: 128 };

async function inflated(base64) {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Reader {
  constructor(bytes) { this.bytes = bytes; this.at = 0; }
  // Copy: typed arrays cannot view words at unaligned offsets.
  take(Type, count) {
    const size = count * Type.BYTES_PER_ELEMENT;
    const part = this.bytes.slice(this.at, this.at + size);
    this.at += size;
    return new Type(part.buffer, 0, count);
  }
  json() {
    const [length] = this.take(Uint32Array, 1);
    return JSON.parse(new TextDecoder().decode(this.take(Uint8Array, length)));
  }
  // Low bytes, then high bytes, of second differences that restart with every body.
  channel(firstOf, total) {
    const low = this.take(Uint8Array, total), high = this.take(Uint8Array, total);
    const values = new Uint16Array(total);
    for (let b = 0; b + 1 < firstOf.length; ++b) {
      let value = 0, way = 0;
      for (let k = firstOf[b]; k < firstOf[b + 1]; ++k) {
        way = (way + low[k] + 256 * high[k]) & 0xffff;
        value = (value + way) & 0xffff;
        values[k] = value;
      }
    }
    return values;
  }
}

function starts(counts) {
  const first = new Uint32Array(counts.length + 1);
  for (let i = 0; i < counts.length; ++i) first[i + 1] = first[i] + counts[i];
  return first;
}

class Trajectory {
  constructor(bytes, about) {
    const reader = new Reader(bytes);
    const n = about.bodies;
    this.frames = about.frames;
    this.count = n;
    this.names = reader.json();
    this.overlays = reader.json();
    this.meshes = about.meshes.map((mesh) => ({
      radius: mesh.radius_m,
      points: reader.take(Float32Array, 3 * mesh.vertices),
      normals: reader.take(Int8Array, 4 * mesh.vertices),
      paint: mesh.is_painted && reader.take(Uint8Array, 4 * mesh.vertices),
      places: mesh.is_textured && reader.take(Float32Array, 2 * mesh.vertices),
      levels: mesh.levels.map((count, i) => ({ indices: reader.take(Uint32Array, count), runs: mesh.runs[i] })),
    }));
    this.id = reader.take(Uint32Array, n);
    this.shape = reader.take(Uint32Array, n);
    this.colour = reader.take(Uint8Array, 4 * n);  // and whether it moves
    this.surface = reader.take(Uint8Array, 4 * n);  // roughness, clear coat, whether it is painted, kind
    this.pattern = reader.take(Float32Array, 2 * n);  // number, length in m
    this.low = reader.take(Float32Array, 3 * n);
    this.step = reader.take(Float32Array, n);
    this.firstKey = starts(reader.take(Uint32Array, n));
    this.firstChange = starts(reader.take(Uint32Array, n));
    const keys = this.firstKey[n], changes = this.firstChange[n];
    this.keyFrame = reader.take(Uint32Array, keys);
    this.position = [0, 1, 2].map(() => reader.channel(this.firstKey, keys));
    this.turn = [0, 1, 2, 3].map(() => new Int16Array(reader.channel(this.firstKey, keys).buffer));
    this.changeFrame = reader.take(Uint32Array, changes);
    this.changeState = reader.take(Uint8Array, changes);
    this.moments = about.overlaps.frames;
    this.depth = reader.take(Uint16Array, n * this.moments.length);
    this.depthUnit = 1 / about.overlaps.units;
    this.pictures = about.pictures.map((size) => reader.take(Uint8Array, size));
    this.cursor = this.firstKey.slice(0, n);
    this.stateCursor = this.firstChange.slice(0, n);
  }

  // Call it before drawing.
  async unpackPictures() {
    this.pictures = await Promise.all(this.pictures.map((png) =>
      createImageBitmap(new Blob([png], { type: "image/png" }), { colorSpaceConversion: "none" })));
  }

  // The last key at or before `frame`.
  keyOf(body, frame) {
    const first = this.firstKey[body], last = this.firstKey[body + 1] - 1;
    let k = this.cursor[body];
    if (this.keyFrame[k] > frame || (k + 8 <= last && this.keyFrame[k + 8] <= frame)) {
      let low = first, high = last;
      while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (this.keyFrame[middle] <= frame) low = middle; else high = middle - 1;
      }
      k = low;
    } else {
      while (k < last && this.keyFrame[k + 1] <= frame) ++k;
    }
    this.cursor[body] = k;
    return k;
  }

  state(body, frame) {
    const first = this.firstChange[body], last = this.firstChange[body + 1] - 1;
    let k = this.stateCursor[body];
    if (this.changeFrame[k] > frame) k = first;
    while (k < last && this.changeFrame[k + 1] <= frame) ++k;
    this.stateCursor[body] = k;
    return this.changeState[k];
  }

  // Writes x y z and the quaternion x y z w to out[at ...].
  pose(body, frame, out, at) {
    const k = this.keyOf(body, frame);
    const start = this.keyFrame[k];
    const isLast = k + 1 === this.firstKey[body + 1];
    const next = isLast ? k : k + 1;
    const share = isLast ? 0 : (frame - start) / (this.keyFrame[next] - start);
    const step = this.step[body];
    for (let axis = 0; axis < 3; ++axis) {
      const values = this.position[axis];
      out[at + axis] = this.low[3 * body + axis] + step * (values[k] + share * (values[next] - values[k]));
    }
    let length = 0;
    for (let c = 0; c < 4; ++c) {
      const values = this.turn[c];
      const value = values[k] + share * (values[next] - values[k]);
      out[at + 3 + c] = value;
      length += value * value;
    }
    length = 1 / Math.sqrt(length || 1);
    for (let c = 3; c < 7; ++c) out[at + c] *= length;
  }

  // Overlap of the body at the measured frame nearest to `frame`, in mean diameters.
  overlap(body, frame) {
    const at = this.moments;
    let k = 0;
    while (k + 1 < at.length && at[k + 1] - frame <= frame - at[k]) ++k;
    return this.depth[at.length * body + k] * this.depthUnit;
  }

  // In m per frame.
  speed(body, frame) {
    const k = this.keyOf(body, frame);
    if (k + 1 === this.firstKey[body + 1]) return 0;
    let sum = 0;
    for (const values of this.position) sum += (values[k + 1] - values[k]) ** 2;
    return this.step[body] * Math.sqrt(sum) / (this.keyFrame[k + 1] - this.keyFrame[k]);
  }
}
