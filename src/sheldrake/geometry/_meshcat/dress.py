"""viser's page as people get it: our title and script, and what those need who see little or hear the page read."""

from __future__ import annotations

import re

# Texts and buttons as dark as readable text must be (4.5 : 1 against what is behind them).
STYLE = """
:root[data-mantine-color-scheme="light"] {
  --mantine-color-dimmed: #495057 !important;
  --mantine-color-blue-filled: #1864ab !important;
  --mantine-color-blue-filled-hover: #14558f !important;
  --mantine-primary-color-filled: #1864ab !important;
  --mantine-primary-color-filled-hover: #14558f !important;
}
.mantine-Button-root[style*="--mantine-color-blue-filled"], .mantine-Button-root:not([style*="--button-bg"]) {
  --button-bg: #1864ab !important;
}
.mantine-Notification-description { color: #495057 !important; }
[data-mantine-color-scheme="dark"] .mantine-Notification-description { color: #ced4da !important; }
header.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
"""

# viser gives no names to its icons, nor to the two inputs of a slider: a label names one element, and theirs none.
# What scrolls is to be reached by keys.
NAMES = """
(() => {
  const icons = { "player-play": "Play", "player-pause": "Pause", adjustments: "Settings", "arrow-back": "Back",
    "list-search": "Commands", share: "Share" };
  const name = (element, text) => {
    if (text && element.getAttribute("aria-label") !== text) element.setAttribute("aria-label", text);
  };
  const icon_name = (button) => {
    if (button.classList.contains("mantine-CloseButton-root")) return "Close";
    const icon = button.querySelector("svg[class*=tabler-icon-]"), classes = icon ? icon.getAttribute("class") : "";
    return icons[Object.keys(icons).find((key) => classes.includes(`tabler-icon-${key}`))];
  };
  const row_text = (element) => {
    for (let box = element; box && box !== document.body; box = box.parentElement) {
      const label = box.querySelector("label");
      if (label) return label.textContent;
    }
  };
  setInterval(() => {
    for (const button of document.querySelectorAll("button"))
      if (!button.textContent.trim() && !button.title) name(button, icon_name(button));
    for (const input of document.querySelectorAll("[role=slider], input:not([type=hidden])")) {
      if (input.ariaLabel || (input.labels && input.labels.length)) continue;
      const playback = !document.querySelector("label");
      name(input, playback ? (input.role === "combobox" ? "Speed" : "Time [s]") : row_text(input));
    }
    for (const area of document.querySelectorAll(".mantine-ScrollArea-viewport")) area.tabIndex = 0;
  }, 300);
})();
"""

# A saved page does not complain about the graphics card of whoever opens it: its script has spared it the shadows.
NO_NOTICE = """
(() => {
  const look = setInterval(() => {
    for (const notice of document.querySelectorAll(".mantine-Notification-root"))
      if (notice.textContent.includes("Software WebGL")) {
        notice.querySelector("button").click();
        clearInterval(look);
      }
  }, 50);
  setTimeout(() => clearInterval(look), 60000);
})();
"""


def dress_page(page: str, script: str, title: str) -> str:
    """Returns a viser page with a title, a description, landmarks, and a script of ours at the end of its head."""
    head, mark, rest = page.partition("</head>")
    head = re.sub(r"<title>.*?</title>", f"<title>{title}</title>", head, count=1)
    head = head.replace('content="Viser client"', 'content="sheldrake scene"')
    header = f'<header class="unseen"><h1>{title}</h1></header>'
    rest = rest.replace('<div id="root">', f'{header}<div id="root" role="main">', 1)
    return f"{head}<style>{STYLE}</style><script>{NAMES}{script}</script>{mark}{rest}"
