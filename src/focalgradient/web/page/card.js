// A bank card (ISO/IEC 7810 ID-1, 85.60 x 53.98 mm), drawn here so that nothing is fetched.
const drawing = `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 8560 5398"><rect width="8560" height="5398" rx="318"
fill="#35608a"/><rect y="900" width="8560" height="1000" fill="#16293b"/><rect x="700" y="2700" width="1100" height="850"
rx="120" fill="#d9c06a"/></svg>`;
export const card = `data:image/svg+xml,${encodeURIComponent(drawing)}`;
export const CARD_MM = 85.6; // width of the card
