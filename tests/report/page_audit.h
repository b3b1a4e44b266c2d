// SPDX-License-Identifier: Apache-2.0
#pragma once

/// JavaScript that looks at the page as shown and returns a list of what a reader would complain about: a page wider
/// than its window, text beyond the window outside of a scrolling box, text smaller than 10.5 pixels or of less
/// contrast than 4.5 (WCAG 2, AA), and images that did not load, are not described, or are squeezed out of shape.
inline constexpr const char* kPageAudit = R"JS((() => {
  const problems = [];
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > width) {
    problems.push(`the page is ${document.documentElement.scrollWidth} pixels wide in a window of ${width}`);
  }

  for (const image of document.images) {
    const box = image.getBoundingClientRect();
    if (!image.complete || image.naturalWidth === 0) problems.push(`an image did not load: ${image.alt}`);
    if (!image.alt) problems.push('an image without a description');
    if (box.right > width + 0.5) problems.push(`an image beyond the window: ${image.alt}`);
    if (box.width < 8 || box.height < 2) problems.push(`an image too small to see: ${image.alt}`);
    const fit = getComputedStyle(image).objectFit;
    const stretch = box.width / box.height / (image.naturalWidth / image.naturalHeight);
    const scale = image.closest('.scales') !== null;
    const bar = image.classList.contains('flat') || image.classList.contains('upright');
    if (!scale && !bar && fit !== 'contain' && Math.abs(stretch - 1) > 0.02) problems.push(`an image out of shape: ${image.alt}`);
  }

  const rgb = (text) => text.match(/[\d.]+/g).map(Number);
  const luminance = (colour) => {
    const [r, g, b] = colour.slice(0, 3).map((c) => {
      const share = c / 255;
      return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const paper = (element) => {
    for (let e = element; e; e = e.parentElement) {
      if (e.localName === 'svg') return rgb(getComputedStyle(e.querySelector('rect')).fill);
      const colour = rgb(getComputedStyle(e).backgroundColor);
      if (colour.length === 3 || colour[3] > 0) return colour;
    }
    return [255, 255, 255];
  };

  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.data.trim(), element = walker.currentNode.parentElement;
    if (text === '' || !element.checkVisibility()) continue;
    const style = getComputedStyle(element), inPlot = element.ownerSVGElement != null;
    const matrix = inPlot ? element.getScreenCTM() : null;
    const size = parseFloat(style.fontSize) * (inPlot ? Math.hypot(matrix.a, matrix.b) : 1);
    if (size < 10.5) problems.push(`text of ${size.toFixed(1)} pixels: ${text}`);
    const levels = [luminance(rgb(inPlot ? style.fill : style.color)), luminance(paper(element))].sort((a, b) => b - a);
    const contrast = (levels[0] + 0.05) / (levels[1] + 0.05);
    if (contrast < 4.5) problems.push(`text of contrast ${contrast.toFixed(2)}: ${text}`);
    const range = document.createRange();
    range.selectNodeContents(walker.currentNode);
    const box = inPlot ? element.getBoundingClientRect() : range.getBoundingClientRect();
    if (!element.closest('.scroll') && (box.left < -0.5 || box.right > width + 0.5)) {
      problems.push(`text beyond the window: ${text}`);
    }
  }
  return problems;
})())JS";
