// Texts in HTML: the first line of a page is its title, an empty line begins a paragraph.

export const escaped = (text) => {
  const span = document.createElement("span");
  span.textContent = text;
  return span.innerHTML;
};

// A text of the session, with its {names} filled in.
export function filled(text, values = {}) {
  return text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}

export function html(text) {
  const [title, ...rest] = text.split("\n");
  const body = rest.join("\n").trim().split(/\n\s*\n/);
  return `<h1>${escaped(title)}</h1>` + body.map((part) => `<p>${escaped(part).replaceAll("\n", "<br>")}</p>`).join("");
}

// Show a page with buttons before or after jsPsych's content; return the index of the button pressed.
export function turned(text, labels) {
  const page = Object.assign(document.createElement("div"), { innerHTML: `<div class="page">${html(text)}</div>` });
  document.getElementById("stage").replaceChildren(page);
  return new Promise((resolve) => {
    labels.forEach((label, number) => {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: label });
      button.addEventListener("click", () => {
        page.remove();
        resolve(number);
      });
      page.append(button);
    });
    page.querySelector("button").focus();
    scrollTo(0, 0);
  });
}
