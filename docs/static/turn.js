/* Recorded runs on the front page that turn: a click on a picture of #runs-to-turn loads the viewer,
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
    return new Response(stream).blob();
  }

  async function turn(link, name) {
    await Promise.all([load("model-viewer.js"), load(`${name}.js`)]);
    const viewer = document.createElement("model-viewer");
    viewer.setAttribute("alt", link.querySelector("img").alt);
    const run = window.recordedRuns[name];
    const settings = {
      "autoplay": "", "camera-controls": "", "interaction-prompt": "none",
      "camera-target": run.target, "camera-orbit": run.orbit, "max-camera-orbit": run.farthest,
    };
    for (const [key, value] of Object.entries(settings)) viewer.setAttribute(key, value);
    viewer.src = URL.createObjectURL(await unpacked(run.glb));
    link.replaceWith(viewer);
    viewer.focus();
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
