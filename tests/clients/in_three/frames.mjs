// Where three.js puts every vertex of a glTF file at given times, and what three-vrm reads of a .vrm.
//
//   node frames.mjs MODULES FILE OUT TIME ...
//
// MODULES is a folder with three and @pixiv/three-vrm. OUT gets float32 numbers: for each mesh and
// line its vertices (V, 3) in the world at each time. Prints their names and sizes, and the VRM.
import { readFile, writeFile } from "node:fs/promises";
import { pathToFileURL } from "node:url";

const [modules, file, out, ...times] = process.argv.slice(2);
// the build that GLTFLoader and three-vrm import too: there must be one three.js
const load = (name) => import(pathToFileURL(`${modules}/node_modules/${name}`));
const THREE = await load("three/build/three.module.js");
const { GLTFLoader } = await load("three/examples/jsm/loaders/GLTFLoader.js");
globalThis.self = globalThis;

const loader = new GLTFLoader();
// a picture needs a browser, and no vertex needs a picture
loader.register(() => ({ name: "NO_PICTURES", loadTexture: async () => new THREE.Texture() }));
if (file.endsWith(".vrm")) {
  const { VRMLoaderPlugin } = await load("@pixiv/three-vrm/lib/three-vrm.module.js");
  loader.register((parser) => new VRMLoaderPlugin(parser));
}
const bytes = await readFile(file);
const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
const gltf = await loader.parseAsync(data, "");
const shown = [];
gltf.scene.traverse((node) => {
  if (node.isMesh || node.isLine) shown.push(node);
});
const mixer = new THREE.AnimationMixer(gltf.scene);
for (const clip of gltf.animations) {
  const action = mixer.clipAction(clip);
  action.loop = THREE.LoopOnce; // else the last frame is the first
  action.clampWhenFinished = true;
  action.play();
}
const places = [];
const point = new THREE.Vector3();
const frame = (node) => {
  const numbers = new Float32Array(3 * node.geometry.attributes.position.count);
  for (let index = 0; index < numbers.length / 3; index++) {
    vertex(node, index).toArray(numbers, 3 * index);
  }
  return Buffer.from(numbers.buffer);
};
const vertex = (node, index) => {
  if (node.isMesh) node.getVertexPosition(index, point); // morphed and skinned
  else morphed(node, index);
  return node.applyMatrix4 ? point.applyMatrix4(node.matrixWorld) : point;
};
const morphed = (node, index) => {
  const { position } = node.geometry.attributes;
  const shapes = node.geometry.morphAttributes.position ?? [];
  const offset = new THREE.Vector3();
  point.fromBufferAttribute(position, index);
  shapes.forEach((shape, number) => {
    offset.fromBufferAttribute(shape, index);
    point.addScaledVector(offset, node.morphTargetInfluences[number]);
  });
};
for (const time of times) {
  mixer.setTime(Number(time));
  gltf.scene.updateMatrixWorld(true);
  for (const node of shown) places.push(frame(node));
}
await writeFile(out, Buffer.concat(places));

const told = { objects: shown.map((n) => [n.name, n.geometry.attributes.position.count]) };
const vrm = gltf.userData.vrm;
if (vrm) {
  const joints = [...vrm.springBoneManager.joints];
  vrm.springBoneManager.setInitState();
  const tips = () => joints.map((j) => j.bone.getWorldPosition(new THREE.Vector3()).toArray());
  const before = tips();
  const head = vrm.humanoid.getRawBoneNode("head");
  for (let step = 0; step < 30; step++) {
    head.rotation.y = 0.02 * step;
    vrm.scene.updateMatrixWorld(true);
    vrm.springBoneManager.update(1 / 60);
  }
  const after = tips();
  vrm.springBoneManager.reset();
  vrm.scene.updateMatrixWorld(true);
  told.vrm = {
    version: vrm.meta.metaVersion,
    bones: Object.keys(vrm.humanoid.humanBones),
    joints: joints.map((j) => j.bone.name),
    colliders: vrm.springBoneManager.colliders.length,
    before,
    after,
    rigid: tips(),
  };
}
console.log(JSON.stringify(told));
