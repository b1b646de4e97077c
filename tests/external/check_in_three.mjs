// What a GLB, or a glTF with its buffers, has become in three.js, against a .csv of the same bodies and frames; by hand, no part
// of the test suite.
//
//   npm install three gltf-validator; node check_in_three.mjs FILE FILE.csv FRAME_RATE [FRAME]
//
// FRAME: of a still. Prints what gltf-validator finds and the largest differences of places (m) and
// of quaternions' components.
import fs from "fs";
import path from "path";
import validator from "gltf-validator";
globalThis.self = globalThis;
globalThis.ProgressEvent ??= Event;  // which three reports of data that it loads
const THREE = await import("three");
const {GLTFLoader} = await import("three/examples/jsm/loaders/GLTFLoader.js");

const [file, csv, rate, still] = process.argv.slice(2);
const bytes = fs.readFileSync(file);
const beside = (uri) => fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri)));
const {issues, validatorVersion} = await validator.validateBytes(
  new Uint8Array(bytes), {externalResourceFunction: async (uri) => new Uint8Array(beside(uri))});
console.log(`gltf-validator ${validatorVersion}: ${issues.numErrors} errors, ${issues.numWarnings} warnings`);

const rows = fs.readFileSync(csv, "utf8").trim().split("\n").slice(1).map((line) => {
  const [, frame, id, rest] = line.match(/^(\d+),[^,]*,(\d+),(?:"(?:[^"]|"")*"|[^,]*),(.*)$/);
  const [x, y, z, qw, qx, qy, qz] = rest.split(",").map(Number);
  return {frame: +frame, id: +id, place: [x, y, z], turn: [qx, qy, qz, qw]};
});
let buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
if (file.endsWith(".gltf")) {
  const document = JSON.parse(bytes);
  for (const part of document.buffers) {
    part.uri = "data:application/octet-stream;base64," + beside(part.uri).toString("base64");
  }
  buffer = JSON.stringify(document);
}
const gltf = await new Promise((done, failed) => new GLTFLoader().parse(buffer, "", done, failed));

let worstPlace = 0, worstTurn = 0, poses = 0, wrong = 0;
function compare(matrix, row) {
  const p = new THREE.Vector3(), q = new THREE.Quaternion(), s = new THREE.Vector3();
  matrix.decompose(p, q, s);
  const turn = q.toArray(), sign = turn.reduce((sum, v, i) => sum + v * row.turn[i], 0) < 0 ? -1 : 1;
  p.toArray().forEach((v, i) => (worstPlace = Math.max(worstPlace, Math.abs(v - row.place[i]))));
  turn.forEach((v, i) => (worstTurn = Math.max(worstTurn, Math.abs(sign * v - row.turn[i]))));
  ++poses;
}

if (still !== undefined) {
  const byId = new Map(rows.filter((row) => row.frame == still).map((row) => [row.id, row]));
  gltf.scene.updateMatrixWorld(true);
  gltf.scene.traverse((thing) => {
    if (!thing.isInstancedMesh) return;
    const ids = thing.geometry.getAttribute("_ID");
    for (let i = 0; i < thing.count; ++i) {
      const matrix = new THREE.Matrix4();
      thing.getMatrixAt(i, matrix);
      compare(matrix.premultiply(thing.matrixWorld), byId.get(ids.getX(i)));
    }
  });
  wrong = Math.abs(poses - byId.size);
} else {
  const mixer = new THREE.AnimationMixer(gltf.scene);
  const action = mixer.clipAction(gltf.animations[0]).setLoop(THREE.LoopOnce);
  action.clampWhenFinished = true;
  const nodes = new Map();
  gltf.scene.traverse((thing) => thing.userData.id !== undefined && nodes.set(thing.userData.id, thing));
  for (let frame = 0; frame <= rows.at(-1).frame; ++frame) {
    action.reset().play();  // it pauses at its end
    mixer.setTime(Math.fround(frame / rate));
    gltf.scene.updateMatrixWorld(true);
    const here = rows.filter((row) => row.frame == frame);
    here.forEach((row) => compare(nodes.get(row.id).matrixWorld, row));
    const ids = new Set(here.map((row) => row.id));
    nodes.forEach((thing, id) => (wrong += thing.scale.x > 0.5 != ids.has(id)));
  }
}
console.log(`three r${THREE.REVISION}, ${file}: ${poses} poses; places differ by ${worstPlace.toPrecision(2)} m, ` +
            `quaternions by ${worstTurn.toPrecision(2)}; ${wrong} shown or hidden wrongly`);
