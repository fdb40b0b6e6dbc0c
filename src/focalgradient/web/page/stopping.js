// A participant who stops before the end: what was answered is kept, or removed at the participant's wish.

// A button beside what jsPsych shows, and the question that it opens. `ways` are the answers: a text and what it does.
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
  document.documentElement.append(button, dialog); // beside the body, which jsPsych fills and listens to
  return button;
}
