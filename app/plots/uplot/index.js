// The door to uPlot: its release, unchanged, as a module; its style sheet on the page.
const here = (name) => new URL(name, import.meta.url).href;

const style = document.createElement("link");
style.rel = "stylesheet";
style.href = here("uPlot.min.css");
document.head.append(style);

// The release is a plain script, which leaves its name on the window and knows nothing of modules.
const script = document.createElement("script");
script.src = here("uPlot.iife.min.js");
await new Promise((resolve, reject) => {
  script.onload = resolve;
  script.onerror = () => reject(new Error("uPlot did not load from " + script.src));
  document.head.append(script);
});

export default window.uPlot;
