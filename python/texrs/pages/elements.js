const view = document.getElementById('view'), marks = document.getElementById('marks');
const list = document.getElementById('list'), layout = document.getElementById('layout');
const gone = new Set(), added = [], svg = 'http://www.w3.org/2000/svg';
const size = Math.max(4, Math.min(...known.box) / 3);
function mark(point, name, scale, angle, kind, act) {
  const group = marks.appendChild(document.createElementNS(svg, 'g')), [row, column] = point;
  const ring = group.appendChild(document.createElementNS(svg, 'ellipse'));
  ring.setAttribute('rx', known.box[1] * scale / 2); ring.setAttribute('ry', known.box[0] * scale / 2);
  ring.setAttribute('transform', `translate(${column} ${row}) rotate(${-angle})`);
  ring.addEventListener('click', event => { event.stopPropagation(); act(); draw(); });
  const text = group.appendChild(document.createElementNS(svg, 'text'));
  text.textContent = name; text.setAttribute('x', column); text.setAttribute('y', row);
  text.setAttribute('font-size', size); group.setAttribute('class', kind);
}
function draw() {
  marks.replaceChildren();
  known.points.forEach((point, k) => mark(point, k, known.scales[k], known.angles[k], gone.has(k) ? 'gone' : '',
    () => gone.has(k) ? gone.delete(k) : gone.add(k)));
  added.forEach((point, k) => mark(point, '+', 1, 0, 'new', () => added.splice(k, 1)));
  const steps = [...known.earlier];
  if (gone.size) steps.push({op: 'drop', elements: [...gone].sort((a, b) => a - b)});
  if (added.length) steps.push({op: 'add', points: added});
  if (layout.value !== known.layout) steps.push({op: 'layout', layout: layout.value});
  list.value = JSON.stringify(steps);
}
view.addEventListener('click', event => {
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(view.getScreenCTM().inverse());
  added.push([Math.round(10 * at.y) / 10, Math.round(10 * at.x) / 10]); draw();
});
layout.addEventListener('change', draw);
draw();
