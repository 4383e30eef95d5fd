// What anywidget gives to `render`, with the state of a widget as JSON for STATE; buffers come at any offset.

const state = STATE, heard = [], out = [];
window.model = {
  get: (name) => state[name],
  set: (name, value) => { state[name] = value; },
  save_changes: () => {
    const { projections, region, measure } = state;
    out.push({ state: { projections, region, measure } });
  },
  send: (content) => out.push({ content }),
  on: (event, work) => heard.push([event, work]),
  off: (event, work) => heard.splice(heard.findIndex((one) => one[0] === event && one[1] === work), 1),
};
const fire = (event, ...rest) => heard.filter((one) => one[0] === event).forEach((one) => one[1](...rest));
window.taken = () => out.splice(0);
window.deliver = (view, text) => {
  const bytes = Uint8Array.from(" ".repeat(3) + atob(text), (letter) => letter.charCodeAt(0));
  fire("msg:custom", { view }, [new DataView(bytes.buffer, 3)]);
};
window.put = (name, value) => { state[name] = value; fire(`change:${name}`); };
window.leave = render({ model, el: document.getElementById("cell") });
