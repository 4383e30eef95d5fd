// Elements of the page, and what leaves it.

export function element(name, properties = {}, children = []) {
  const { list, ...others } = properties;
  const node = Object.assign(document.createElement(name), others);
  if (list) node.setAttribute("list", list);
  node.append(...children);
  return node;
}

export function download(blob, name) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// A text with a button that copies it.
export function copyText(name, text) {
  const block = element("pre", { textContent: text, tabIndex: 0 });
  const button = element("button", { type: "button", textContent: `Copy ${name}` });
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // Without leave to use the clipboard, an older way.
      getSelection().selectAllChildren(block);
      document.execCommand("copy");
    }
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = `Copy ${name}`), 1500);
  });
  return element("div", { className: "copied" }, [button, block]);
}
