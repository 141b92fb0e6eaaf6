// Sums of colour and weight, two words for each pixel; blocks of 2 x 4 pixels share a cache line.

const float SUM_UNIT = 1024.0;

uint sum_index(ivec2 pixel, int width) {
    uint block = uint((pixel.y >> 2) * ((width + 1) >> 1) + (pixel.x >> 1));
    return 16u * block + 4u * uint(pixel.y & 3) + 2u * uint(pixel.x & 1);
}
