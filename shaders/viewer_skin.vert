#version 430
// Skin lit at its vertices, which is faster on software renderers and fine enough for this mesh.
#include "skin.glsl"
#include "albedo.glsl"

uniform mat4 u_clip_from_head;
uniform float u_push_m;

in vec3 in_position;
in vec3 in_normal;
in vec3 in_colour;
in vec2 in_uv;

out vec3 v_light;   // toned already where no picture is to be multiplied by it
out vec3 v_specular;
out vec2 v_uv;

void main() {
    vec4 clip = u_clip_from_head * vec4(in_position, 1.0);
    vec4 pushed = u_clip_from_head * vec4(in_position + u_push_m * u_forward, 1.0);
    gl_Position = vec4(clip.xy, pushed.z / pushed.w * clip.w, clip.w);
    Layers layers = skin_layers(in_position, normalize(in_normal), u_roughness);
    vec3 flesh = in_colour * layers.diffuse;
    v_light = u_textured > 0.5 ? flesh : tone(flesh + layers.specular);
    v_specular = layers.specular;
    v_uv = in_uv;
}
