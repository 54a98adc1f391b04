// Mounts the parts of the page.

import { adoptToken } from "./api.js";
import { onChange, start } from "./store.js";
import { mountTop } from "./top.js";
import { mountAlarms } from "./alarms.js";
import { mountCommandAuthority } from "./command-authority.js";
import { mountStaleness } from "./staleness.js";
import { mountStrip } from "./strip.js";
import { mountFleet } from "./fleet.js";
import { mountMission } from "./mission.js";
import { mountEditor } from "./editor.js";
import { mountMap } from "./map.js";
import { mountCommands } from "./commands.js";
import { mountContingencies } from "./contingencies.js";
import { mountPermissions } from "./permissions.js";
import { mountTimeline } from "./timeline.js";
import { mountTree } from "./tree.js";
import { mountPlots } from "./plots.js";
import { mountProcesses } from "./processes.js";
import { mountRecordings } from "./recordings.js";
import { mountInjection, mountTrouble } from "./injection.js";

const parts = [
  mountTop,
  mountCommandAuthority,
  mountStaleness,
  mountAlarms,
  mountStrip,
  mountFleet,
  mountMission,
  mountEditor,
  mountMap,
  mountCommands,
  mountContingencies,
  mountPermissions,
  mountTimeline,
  mountTree,
  mountPlots,
  mountProcesses,
  mountRecordings,
  mountTrouble,
  mountInjection,
];

adoptToken();
for (const mount of parts) onChange(mount());
start();
