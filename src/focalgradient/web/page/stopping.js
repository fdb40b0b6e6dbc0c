// A participant stops before the end: responses are kept, or removed on request. A button beside jsPsych's content
// opens a
// question; `ways` are its answers: a text and an action each.
export function stopButton(label, question, ways) {
  const button = Object.assign(document.createElement("button"), { id: "stop", type: "button", textContent: label, hidden: true });
  const dialog = Object.assign(document.createElement("dialog"), { id: "stopping", className: "page", innerHTML: question });
  dialog.setAttribute("aria-label", label);
  for (const [text, act] of ways) {
    const way = Object.assign(document.createElement("button"), { type: "button", textContent: text });
    way.addEventListener("click", () => {
      dialog.close();
      act();
    });
    dialog.append(way);
  }
  button.addEventListener("click", () => dialog.showModal());
  document.documentElement.append(button, dialog); // outside the body, which jsPsych fills and listens to
  return button;
}
