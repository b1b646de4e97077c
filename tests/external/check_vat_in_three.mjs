// What a vertex animation has become in three.js, by its own loaders of GLB and EXR, against a .csv of
// the same bodies and frames; by hand, no part of the test suite.
//
//   npm install three gltf-validator; node check_vat_in_three.mjs PILE (of PILE.vat.glb ...) FILE.csv
//
// Puts vertices where the shader of docs/export.md does, and prints the largest differences (m).
import fs from "fs";
import validator from "gltf-validator";
globalThis.self = globalThis;
const THREE = await import("three");
const {GLTFLoader} = await import("three/examples/jsm/loaders/GLTFLoader.js");
const {EXRLoader} = await import("three/examples/jsm/loaders/EXRLoader.js");

const [pile, csv] = process.argv.slice(2);
const bytesOf = (name) => {
  const bytes = fs.readFileSync(name);
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
};
const {issues, validatorVersion} = await validator.validateBytes(new Uint8Array(bytesOf(pile + ".vat.glb")));
console.log(`gltf-validator ${validatorVersion}: ${issues.numErrors} errors, ${issues.numWarnings} warnings`);
const about = JSON.parse(fs.readFileSync(pile + ".vat.json", "utf8"));
const loader = new EXRLoader().setDataType(THREE.FloatType);
const [positions, rotations] = ["position", "rotation"].map((name) => loader.parse(bytesOf(`${pile}.vat.${name}.exr`)));
const gltf = await new Promise((done, failed) => new GLTFLoader().parse(bytesOf(pile + ".vat.glb"), "", done, failed));
let mesh;
gltf.scene.traverse((thing) => (mesh = thing.isMesh ? thing : mesh));
const {position, _body, uv} = mesh.geometry.attributes;

// EXRLoader turns pictures upside down: its first row is the lowest one.
function texel(picture, column, row) {
  const at = 4 * ((picture.height - 1 - row) * picture.width + column);
  return picture.data.slice(at, at + 4);
}
const ids = new Map(about.body_id.map((id, number) => [id, number]));
const first = [];
for (let i = 0; i < position.count; ++i) first[_body.getX(i)] ??= i;
let worstPlace = 0, worstVertex = 0, poses = 0, hidden = 0;
for (const line of fs.readFileSync(csv, "utf8").trim().split("\n").slice(1)) {
  const [, frame, id, rest] = line.match(/^(\d+),[^,]*,(\d+),(?:"(?:[^"]|"")*"|[^,]*),(.*)$/);
  const [x, y, z, qw, qx, qy, qz] = rest.split(",").map(Number), number = ids.get(+id);
  const column = number % about.width;
  const row = (+frame - about.first_frame) * about.rows_of_a_frame + Math.floor(number / about.width);
  const t = texel(positions, column, row), q = texel(rotations, column, row);
  hidden += t[3] !== 1;
  const vertex = new THREE.Vector3().fromBufferAttribute(position, first[number]);
  const drawn = vertex.clone().applyQuaternion(new THREE.Quaternion(...q)).add(new THREE.Vector3(t[0], t[1], t[2]));
  const expected = vertex.applyQuaternion(new THREE.Quaternion(qx, qy, qz, qw)).add(new THREE.Vector3(x, y, z));
  worstPlace = Math.max(worstPlace, Math.abs(t[0] - x), Math.abs(t[1] - y), Math.abs(t[2] - z));
  worstVertex = Math.max(worstVertex, drawn.distanceTo(expected));
  if (Math.floor(uv.getX(first[number]) * about.width) !== column) throw new Error("texture coordinates");
  ++poses;
}
console.log(`three r${THREE.REVISION}: ${poses} poses; places differ by ${worstPlace.toPrecision(2)} m, ` +
            `vertices by ${worstVertex.toPrecision(2)} m; ${hidden} hidden wrongly`);
