"""The viewer's window: everything that the operating system or the user touches directly.

It passes events on to the actions and shows what the preview has drawn.

* `file_watcher`: files that changed on disk
* `gl_context`: a window with an OpenGL context
* `hud`: text over the picture
* `keyboard`: names of keys
* `mouse`: mouse events to actions
* `panel`: the optional panel of sliders
* `splash`: the window until the first frame
* `window`: the window itself
"""
