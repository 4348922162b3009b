// Each comparison: two pictures one over the other, chosen by lists, and presets for pairs of equal time and equal error.
for (const box of document.querySelectorAll('.comparison')) {
  const slider = box.querySelector('.slider');
  const [left, right] = box.querySelectorAll('select');
  const picture = (key) => document.querySelector(`[data-key="${key}"]`).src;
  const show = () => {
    slider.querySelector('.under').src = picture(left.value);
    slider.querySelector('.over').src = picture(right.value);
  };
  const move = (event) => {
    const r = slider.getBoundingClientRect();
    const at = Math.min(Math.max((event.clientX - r.left) / r.width, 0), 1);
    slider.style.setProperty('--at', `${100 * at}%`);
  };
  slider.addEventListener('pointerdown', (event) => { slider.setPointerCapture(event.pointerId); move(event); });
  slider.addEventListener('pointermove', (event) => { if (event.buttons) move(event); });
  left.addEventListener('change', show);
  right.addEventListener('change', show);
  for (const button of box.querySelectorAll('button')) {
    button.addEventListener('click', () => { left.value = button.dataset.left; right.value = button.dataset.right; show(); });
  }
  show();
}
document.documentElement.dataset.ready = 'yes';
