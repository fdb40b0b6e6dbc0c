// A number to three significant digits, without zeros that say nothing: 1.5, 120, 1000.
export const significant = (value) => String(Number(value.toPrecision(3)));
