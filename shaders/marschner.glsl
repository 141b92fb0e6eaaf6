// Light from a hair fibre, a cheap form of Marschner et al. 2003, Light Scattering from Human Hair Fibers:
// R off the surface, TT through the fibre, TRT off its inner back, each a Gaussian about the tilted
// cone; multiple scattering is the diffuse term of Kajiya and Kay (1989).

#constants hairkit.rendering.fibre TILT ROUGHNESS FRESNEL R_SCALE TT_SHARE TRT_SHARE TT_FOCUS TRT_FOCUS SPREAD DIFFUSE

float lobe(float x, float width) { return exp(-0.5 * x * x / (width * width)) / width; }

vec3 fibre(vec3 tangent, vec3 to_light, vec3 to_eye, vec3 colour, float jitter) {
    float sin_in = dot(tangent, to_light);
    float sin_out = dot(tangent, to_eye);
    float theta = asin(clamp(sin_in, -1.0, 1.0)) + asin(clamp(sin_out, -1.0, 1.0));
    float half_theta = 0.5 * theta + (jitter - 0.5) * SPREAD;
    vec3 light_across = to_light - sin_in * tangent;
    vec3 eye_across = to_eye - sin_out * tangent;
    float cos_phi = dot(light_across, eye_across)
        * inversesqrt(dot(light_across, light_across) * dot(eye_across, eye_across) + 1e-6);
    float cos_half_phi = sqrt(0.5 + 0.5 * clamp(cos_phi, -1.0, 1.0));

    float r = R_SCALE * cos_half_phi * lobe(half_theta + 2.0 * TILT, ROUGHNESS);
    float tt = exp(TT_FOCUS * (-cos_phi - 1.0)) * lobe(half_theta - TILT, 0.5 * ROUGHNESS);
    float trt = exp(TRT_FOCUS * (cos_phi - 1.0)) * lobe(half_theta - 3.0 * TILT, 2.0 * ROUGHNESS);
    float cos_in = sqrt(max(1.0 - sin_in * sin_in, 0.0));
    vec3 single = FRESNEL * r + TT_SHARE * colour * tt + TRT_SHARE * colour * sqrt(colour) * trt;
    return cos_in * (single + colour * (DIFFUSE + DIFFUSE * cos_half_phi));
}
