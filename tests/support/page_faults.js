// What is wrong with an open page, a sentence each.
() => {
  const all = selector => [...document.querySelectorAll(selector)];
  const start = element => element.outerHTML.slice(0, 80);

  // Text outside drawings that is darker or lighter than what is behind it by less than it takes to read it.
  const parts = text => (text.match(/[\d.]+/g) || []).map(Number);
  const linear = v => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  const behind = element => {
    for (; element; element = element.parentElement) {
      const color = parts(getComputedStyle(element).backgroundColor);
      if (color.length === 3 || color[3] > 0) return color;
    }
    return [255, 255, 255];
  };
  const faint = [], texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const text = texts.currentNode.data.trim(), element = texts.currentNode.parentElement;
    if (!text || element.closest("svg, script") || !element.checkVisibility()) continue;
    const [low, high] = [parts(getComputedStyle(element).color), behind(element)].map(light).sort((a, b) => a - b);
    if ((high + 0.05) / (low + 0.05) < 4.5) faint.push(`too faint: ${text.slice(0, 40)}`);
  }

  const named = element => element.getAttribute("aria-label") || element.getAttribute("aria-labelledby");
  const unnamed = all("img, [role=region], [role=application], button, select, nav, section")
    .filter(e => e.tagName === "IMG" ? !e.alt : !named(e) && !e.textContent.trim());
  const ids = all("[id]").map(element => element.id);
  const acting = all("*").filter(e => e.getAttributeNames().some(name => name.startsWith("on"))
    || ["IFRAME", "OBJECT", "EMBED", "FORM"].includes(e.tagName) || (e.tagName === "IMG" && !e.src.startsWith("data:")));
  const levels = all("h1, h2, h3, h4").map(element => Number(element.tagName[1]));
  const wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
  return [
    ...faint,
    ...unnamed.map(element => `without a name: ${start(element)}`),
    ...ids.filter((id, i) => ids.indexOf(id) !== i).map(id => `used twice: ${id}`),
    ...acting.map(element => `acts: ${start(element)}`),
    ...levels.filter((level, i) => i && level > levels[i - 1] + 1).map(level => `a heading of level ${level} too deep`),
    ...(levels[0] === 1 && levels.filter(level => level === 1).length === 1 ? [] : ["not one main heading, at the top"]),
    ...(["header", "nav", "main", "footer"].filter(tag => all(`body > ${tag}`).length !== 1).map(tag => `not one ${tag}`)),
    ...(wide > 0 ? [`wider than the screen by ${wide}`] : []),
  ];
}
