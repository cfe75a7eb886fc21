/* Recorded runs on the front page that turn: a click on a picture of #runs-to-turn loads three.js,
   once, and the run, which is glTF, packed by gzip, in base64, so that pages from a disc have it too. */

(() => {
  const folder = new URL("turn/", document.currentScript.src);
  const asked = new Map();

  function load(name) {
    if (!asked.has(name)) {
      asked.set(name, new Promise((done, failed) => {
        const script = document.createElement("script");
        script.src = new URL(name, folder);
        script.onload = done;
        script.onerror = () => failed(new Error(`${name} cannot be loaded`));
        document.head.append(script);
      }));
    }
    return asked.get(name);
  }

  async function unpacked(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  }

  async function turn(link, name) {
    await Promise.all([load("three.js"), load(`${name}.js`)]);
    const run = window.recordedRuns[name];
    const glb = await unpacked(run.glb);
    const gltf = await new Promise((done, failed) => new THREE.GLTFLoader().parse(glb, "", done, failed));
    const renderer = new THREE.WebGLRenderer({ antialias: true });
    renderer.outputEncoding = THREE.sRGBEncoding;
    renderer.setPixelRatio(window.devicePixelRatio);
    renderer.setClearColor("#f2f5f7");
    renderer.domElement.setAttribute("role", "img");
    renderer.domElement.setAttribute("aria-label", link.querySelector("img").alt);
    link.replaceWith(renderer.domElement);

    const scene = new THREE.Scene(), sun = new THREE.DirectionalLight("white", 0.9);
    const camera = new THREE.PerspectiveCamera(30, 4 / 3, run.distance / 100, run.distance * 100);
    scene.add(new THREE.HemisphereLight("white", "#889099", 0.8), sun, gltf.scene);
    const target = new THREE.Vector3(...run.target);
    camera.position.setFromSphericalCoords(run.distance, ...run.angles).add(target);
    const controls = new THREE.TrackballControls(camera, renderer.domElement);
    Object.assign(controls, { target, rotateSpeed: 3, noPan: true, maxDistance: 2 * run.distance });
    const mixer = new THREE.AnimationMixer(gltf.scene), clock = new THREE.Clock();
    gltf.animations.forEach((clip) => mixer.clipAction(clip).play());

    new ResizeObserver(([{ contentRect: { width } }]) => {
      renderer.setSize(width, 0.75 * width, false);
      controls.handleResize();
    }).observe(renderer.domElement);
    window.addEventListener("scroll", controls.handleResize);
    renderer.setAnimationLoop(() => {
      mixer.update(clock.getDelta());
      controls.update();
      sun.position.copy(camera.position);
      renderer.render(scene, camera);
    });
  }

  document.addEventListener("DOMContentLoaded", () => {
    for (const card of document.querySelectorAll("#runs-to-turn li")) {
      const link = card.querySelector("a");
      const name = card.querySelector("code").textContent.split(" ").pop();
      link.setAttribute("role", "button");
      link.setAttribute("aria-label", `Turn: ${link.querySelector("img").alt}`);
      link.addEventListener("click", (event) => {
        event.preventDefault();
        link.classList.add("loading");
        turn(link, name).catch(() => { location.href = link.href; });
      });
    }
  });
})();
