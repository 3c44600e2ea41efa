// Measures a page once it is laid out, and leaves the result in it as JSON for `--dump-dom`.
const refused = [];
addEventListener("securitypolicyviolation", (event) => refused.push(event.violatedDirective + " " + event.blockedURI));
addEventListener("error", (event) => refused.push(String(event.message)));
addEventListener("load", () => {
  const beyond = [], overlapping = [], flat = [];
  for (const svg of document.querySelectorAll("figure svg")) {
    const frame = svg.getBoundingClientRect();
    if (frame.width < 10 || frame.height < 4) flat.push(svg.getAttribute("aria-label"));
    const texts = [...svg.querySelectorAll("text")].map((text) => [text.textContent, text.getBoundingClientRect()]);
    for (const [name, box] of texts) {
      if (box.left < frame.left - 1 || box.right > frame.right + 1 || box.top < frame.top - 1 || box.bottom > frame.bottom + 1) {
        beyond.push(name);
      }
    }
    texts.forEach(([name, a], number) => {
      for (const [other, b] of texts.slice(number + 1)) {
        const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        // Boxes of text are higher than its letters.
        if (wide > 1 && high > 0.4 * a.height) overlapping.push(name + " / " + other);
      }
    });
  }
  // Luminance of a colour as WCAG 2 defines it.
  const luminance = (colour) => {
    const [r, g, b] = colour.match(/[\d.]+/g).slice(0, 3).map((channel) => {
      const share = channel / 255;
      return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const paper = luminance(getComputedStyle(document.body).backgroundColor);
  const contrast = (colour) => {
    const [low, high] = [luminance(colour), paper].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  };
  const styled = (selector, property) =>
    [...document.querySelectorAll(selector)].map((node) => contrast(getComputedStyle(node)[property]));
  const result = {
    dark: paper < 0.5,
    width: innerWidth,
    too_wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    drawings: document.querySelectorAll("figure svg").length,
    fetched: performance.getEntriesByType("resource").length,
    text_contrast: Math.min(...styled("p, td, dt, dd, h1, h2, figcaption, .faint", "color"), ...styled("figure text", "fill")),
    line_contrast: Math.min(...styled("figure .line", "stroke"), ...styled("figure .fill", "fill")),
    smallest_text: Math.min(...[...document.querySelectorAll("figure text")].map((text) => text.getBoundingClientRect().height)),
    beyond, overlapping, flat, refused,
  };
  const place = document.createElement("pre");
  place.id = "measured";
  place.textContent = JSON.stringify(result);
  document.body.append(place);
});
