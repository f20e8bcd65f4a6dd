// SPDX-License-Identifier: Apache-2.0
// Decodes the messages that docs/view.md describes.

// Returns a message as an object with its `type`: JSON as it is, and the binary types "chunk", "image" and "path".
export function decode(data) {
  if (typeof data === 'string') return JSON.parse(data);
  return [decodeChunk, decodeImage, decodePath, decodeMesh][new Uint8Array(data, 0, 1)[0] - 1](data);
}

function decodeChunk(buffer) {
  const head = new DataView(buffer), count = head.getUint32(20, true);
  return { type: 'chunk', count, cell: [4, 8, 12].map((at) => head.getInt32(at, true)), edge: head.getFloat32(16, true),
    positions: new Uint16Array(buffer, 24, 4 * count), colors: new Uint8Array(buffer, 24 + 8 * count, 4 * count) };
}

function decodeImage(buffer) {
  return { type: 'image', frame: new DataView(buffer).getUint32(4, true), jpeg: new Uint8Array(buffer, 8) };
}

function decodePath(buffer) {
  const head = new DataView(buffer), n = head.getUint32(4, true), first = head.getFloat64(8, true);
  const message = { type: 'path', n, t: new Float64Array(n), p: new Float32Array(7 * n), s: new Uint8Array(n) };
  for (let i = 0, at = 16; i < n; ++i, at += 36) {
    message.t[i] = first + head.getFloat32(at, true);
    message.p.set(new Float32Array(buffer, at + 4, 7), 7 * i);
    message.s[i] = head.getUint32(at + 32, true);
  }
  return message;
}

// The file mesh.glb begins at byte 4. Those of former versions have no texture; they are not shown.
function decodeMesh(buffer) {
  const head = new DataView(buffer, 4), size = head.getUint32(12, true), json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 24, size)));
  if (!json.images) return { type: 'no-mesh' };
  const view = (Type, number) => {
    const { byteOffset, byteLength } = json.bufferViews[number];
    return new Type(buffer, 32 + size + byteOffset, byteLength / Type.BYTES_PER_ELEMENT);
  };
  return { type: 'mesh', triangles: view(Uint32Array, 0), positions: view(Float32Array, 1), places: view(Float32Array, 2), jpeg: view(Uint8Array, 3) };
}

// Calls a function with the first index and the number of each run of cells of the message "planner" that have a value.
export function forEachRun(cells, value, call) {
  for (let i = 0, at = 0; i < cells.length; at += cells[i + 1], i += 2) if (cells[i] === value) call(at, cells[i + 1]);
}
