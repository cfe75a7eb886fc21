// Runs in the page of the viewer, after `page` = {title, css}; again whenever it connects again.
document.title = page.title;

const ICONS = {
  "tabler-icon-list-search": "commands",
  "tabler-icon-adjustments": "settings of the page",
  "tabler-icon-maximize": "enlarge the plot",
};
const BUTTONS = { "◀": "frame before", "▶": "next frame" };
const ENDED = "flowborne has ended, or cannot be reached. Start the same command again, and this page goes on.";

// viser gives labels to neither its sliders nor its buttons with icons
function nameControls() {
  for (const label of document.querySelectorAll("label[for]")) {
    const row = label.closest(".mantine-Flex-root");
    for (const control of row ? row.querySelectorAll("[role=slider], input") : [])
      if (!control.getAttribute("aria-label")) control.setAttribute("aria-label", label.textContent);
  }
  for (const button of document.querySelectorAll("button:not([aria-label])")) {
    const icon = button.querySelector("svg");
    const found = icon && Object.keys(ICONS).find((name) => icon.classList.contains(name));
    const closes = button.classList.contains("mantine-CloseButton-root") && "close";
    const name = BUTTONS[button.textContent] || ICONS[found] || closes;
    if (name) button.setAttribute("aria-label", name);
  }
}

// on a phone the panel starts as one row at the bottom
function shutSheet() {
  const sheet = document.querySelector('.mantine-Paper-root[style*="position: fixed"]');
  if (!sheet || sheet.dataset.shut || !matchMedia("(max-width: 600px)").matches) return;
  sheet.dataset.shut = "yes";
  sheet.querySelector('[style*="cursor: pointer"]')?.click();
}

function update() {
  nameControls();
  shutSheet();
}

if (!document.getElementById("flowborne")) {
  const sheet = document.createElement("style");
  sheet.id = "flowborne";
  sheet.textContent = page.css;
  document.head.append(sheet);
  document.getElementById("root").setAttribute("role", "main");

  const ended = document.createElement("div");
  ended.id = "ended";
  ended.setAttribute("role", "alert");
  document.body.append(ended);
  let seconds = 0;
  setInterval(() => {
    // the dots that viser shows while it has no connection
    seconds = document.querySelector(".mantine-Loader-root") ? seconds + 1 : 0;
    ended.textContent = seconds >= 2 ? ENDED : "";
  }, 1000);

  let due = false;
  new MutationObserver(() => {
    if (due) return;
    due = true;
    setTimeout(() => { due = false; update(); }, 200);
  }).observe(document.getElementById("root"), { childList: true, subtree: true });
  update();
}
