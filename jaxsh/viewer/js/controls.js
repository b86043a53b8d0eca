// The panel beside the picture: labeled inputs that call back with what they were set to.

const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};

// A slider with its value in words; `set` moves it without calling back.
export function slider(label, { min, max, step, value, said, changed }) {
  const input = make("input", { type: "range", min, max, step, value });
  const output = make("output", {}, said(value));
  const set = (number) => {
    input.value = number;
    output.textContent = said(Number(input.value));
    input.setAttribute("aria-valuetext", output.textContent);
  };
  input.addEventListener("input", () => {
    set(input.value);
    changed(Number(input.value));
  });
  set(value);
  // The first control in a label is the one that it names, and an output is one too.
  return { element: make("label", { className: "jaxsh-slider" }, label, input, output), set };
}

export function menu(label, names, changed) {
  const options = names.map((name, i) => make("option", { value: i }, name));
  const select = make("select", {}, ...options);
  select.addEventListener("change", () => changed(Number(select.value)));
  const set = (number) => (select.value = number);
  return { element: make("label", { className: "jaxsh-menu" }, label, select), set };
}

// A button that stays down until it is pressed again.
export function toggle(label, changed) {
  const element = make("button", { type: "button" }, label);
  const set = (on) => element.setAttribute("aria-pressed", on);
  element.addEventListener("click", () => {
    const on = element.getAttribute("aria-pressed") !== "true";
    set(on);
    changed(on);
  });
  set(false);
  return { element, set };
}

export function button(label, pressed) {
  const element = make("button", { type: "button" }, label);
  element.addEventListener("click", pressed);
  return { element };
}

export function panel(title, controls, buttons, hint) {
  return make(
    "div",
    { className: "jaxsh-panel" },
    make("h1", {}, title),
    ...controls.map((control) => control.element),
    make("div", { className: "jaxsh-buttons" }, ...buttons.map((one) => one.element)),
    make("p", {}, hint),
  );
}
