// Sums of colour and weight, two words for each pixel; blocks of 2 x 4 pixels share a cache line.

uniform float u_dimming;        // share of the hair before a strand that dims it

// Of a weight of 1. Strands that dim each other less add up to more: 16 bits hold 64 times 1024.
float sum_unit() { return 1024.0 * u_dimming; }

uint sum_index(ivec2 pixel, int width) {
    uint block = uint((pixel.y >> 2) * ((width + 1) >> 1) + (pixel.x >> 1));
    return 16u * block + 4u * uint(pixel.y & 3) + 2u * uint(pixel.x & 1);
}
