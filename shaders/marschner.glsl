// Light from a hair fibre, a cheap form of Marschner et al. 2003, Light Scattering from Human Hair Fibers:
// R off the surface, TT through the fibre, TRT off its inner back, each a Gaussian about the tilted
// cone; multiple scattering is the diffuse term of Kajiya and Kay (1989).

const float TILT = 0.0524;            // cuticle tilt of 3 degrees; R leans -2, TT 1, TRT 3 times it
const float ROUGHNESS_R = 0.14;       // longitudinal widths in radians; TT half, TRT twice (Marschner)
const float FRESNEL = 0.0465;         // of keratin, index 1.55, at normal incidence
const float TT_SHARE = 0.09;
const float TRT_SHARE = 0.17;

float lobe(float x, float width) { return exp(-0.5 * x * x / (width * width)) / width; }

vec3 fibre(vec3 tangent, vec3 to_light, vec3 to_eye, vec3 colour, float jitter) {
    float sin_in = dot(tangent, to_light);
    float sin_out = dot(tangent, to_eye);
    float theta = asin(clamp(sin_in, -1.0, 1.0)) + asin(clamp(sin_out, -1.0, 1.0));
    float half_theta = 0.5 * theta + (jitter - 0.5) * 0.12;
    vec3 light_across = to_light - sin_in * tangent;
    vec3 eye_across = to_eye - sin_out * tangent;
    float cos_phi = dot(light_across, eye_across)
        * inversesqrt(dot(light_across, light_across) * dot(eye_across, eye_across) + 1e-6);
    float cos_half_phi = sqrt(0.5 + 0.5 * clamp(cos_phi, -1.0, 1.0));

    float r = 0.16 * cos_half_phi * lobe(half_theta + 2.0 * TILT, ROUGHNESS_R);
    float tt = exp(4.0 * (-cos_phi - 1.0)) * lobe(half_theta - TILT, ROUGHNESS_R);
    float trt = exp(3.0 * (cos_phi - 1.0)) * lobe(half_theta - 3.0 * TILT, 2.0 * ROUGHNESS_R);
    float cos_in = sqrt(max(1.0 - sin_in * sin_in, 0.0));
    vec3 single = FRESNEL * r + TT_SHARE * colour * tt + TRT_SHARE * colour * sqrt(colour) * trt;
    return cos_in * (single + colour * (0.26 + 0.26 * cos_half_phi));
}
